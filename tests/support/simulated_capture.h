// A capture that lumi-simulate makes once for all tests of a program.
#pragma once

#include <string>
#include <vector>

#include "tests/support/child_program.h"

namespace lumi {

class SimulatedCapture {
 public:
  SimulatedCapture(const std::string& example, int views, int width_px, const std::vector<std::string>& more = {}) {
    std::vector<std::string> argv{
        "lumi-simulate",          "--example", example,         "--views", std::to_string(views), "--width",
        std::to_string(width_px), "-o",        path().string(), "--quiet"};
    argv.insert(argv.end(), more.begin(), more.end());
    const ProgramResult made = RunProgram(argv);
    if (made.exit_code != 0) throw std::runtime_error("lumi-simulate failed: " + made.err);
  }
  std::filesystem::path path() const { return folder_ / "capture"; }
  std::filesystem::path photos() const { return path() / "images"; }
  // For results of the tests.
  std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }

 private:
  TemporaryFolder folder_;
};

}  // namespace lumi
