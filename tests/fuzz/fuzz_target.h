// A fuzz target: any bytes, given to a reader as the file that it reads. The same targets are driven by libFuzzer
// (./fuzz.sh, one executable each) and, over seeds and earlier findings, by replay_test.cc in every test run.
//
//   LUMI_FUZZ_TARGET(camera_yaml) {
//     const Camera camera = ReadCameraYaml(InputFile("camera.yaml", bytes));
//     Require(camera.width_px > 0, "a camera without a size was accepted");
//   }
//
// The contract (docs/fuzzing.md): a value, or an Error that says in one line what the input has wrong. Nothing else is
// thrown, nothing crashes or hangs, and memory is bounded by the input's size.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace lumi::fuzz {

struct Target {
  std::string name;
  void (*read)(std::string_view bytes);
};

// All that are linked in.
std::vector<Target>& Targets();
bool Register(const char* name, void (*read)(std::string_view bytes));

// The reader broke the contract.
struct ContractBroken : std::logic_error {
  using std::logic_error::logic_error;
};

// Whether the bytes were accepted; false: refused as the contract says. Throws ContractBroken.
bool Accepts(const Target& target, std::string_view bytes);

// A file of these bytes in this process's own folder, which lies in memory where the system allows it and goes with the
// process. `name` may have folders in it.
std::filesystem::path InputFile(const std::string& name, std::string_view bytes);
// That folder.
const std::filesystem::path& InputFolder();

// What holds for a value that a reader gives.
inline void Require(bool holds, const char* what) {
  if (!holds) throw ContractBroken(what);
}

}  // namespace lumi::fuzz

#define LUMI_FUZZ_TARGET(target)                                                             \
  static void Fuzz_##target(std::string_view bytes);                                         \
  [[maybe_unused]] static const bool kRegistered_##target =                                  \
      ::lumi::fuzz::Register(#target, [](std::string_view bytes) { Fuzz_##target(bytes); }); \
  static void Fuzz_##target([[maybe_unused]] std::string_view bytes)
