#include "tests/benchmark/captures.h"

namespace lumi {

std::vector<BenchCapture> BenchCaptures(const std::filesystem::path& data,
                                        const std::filesystem::path& simulated_desk) {
  std::vector<BenchCapture> captures{{"desk (simulated)", simulated_desk / "images", simulated_desk / "truth"}};
  if (data.empty()) return captures;
  for (const BenchCapture& real : {BenchCapture{"fountain", data / "fountain/images", data / "fountain/truth"},
                                   BenchCapture{"sceaux", data / "sceaux/images", {}},
                                   BenchCapture{"fox", data / "fox/images", data / "fox/transforms.json"}})
    if (std::filesystem::is_directory(real.photos)) captures.push_back(real);
  return captures;
}

}  // namespace lumi
