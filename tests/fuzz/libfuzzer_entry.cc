// libFuzzer's door to the one target that is linked in.
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    lumi::fuzz::Accepts(lumi::fuzz::Targets().at(0), {reinterpret_cast<const char*>(data), size});
  } catch (const lumi::fuzz::ContractBroken& e) {
    std::fprintf(stderr, "CONTRACT: %s\n", e.what());
    std::abort();
  }
  return 0;
}
