#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "tests/support/fault_run.h"

namespace lumi {
namespace fs = std::filesystem;

FaultRun RunWithFault(const std::vector<std::string>& argv, FaultKind kind, long at, const fs::path& below,
                      std::map<std::string, std::string> environment) {
  const TemporaryFolder folder;
  const fs::path log = folder / "log";
  environment["LD_PRELOAD"] = LUMI_FAULT_LIBRARY;
  environment["LUMI_FAULT_BELOW"] = below.string();
  environment["LUMI_FAULT_PROGRAM"] = argv.at(0);
  environment["LUMI_FAULT_KIND"] = kind == FaultKind::kWrite ? "write" : kind == FaultKind::kRead ? "read" : "memory";
  environment["LUMI_FAULT_AT"] = std::to_string(at);
  environment["LUMI_FAULT_LOG"] = log.string();
  FaultRun run;
  run.result = RunProgram(argv, environment);
  std::ifstream lines(log);
  // After "failed": its call stack, where it is known.
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string what;
    long n = 0;
    words >> what >> n;
    std::string call;
    std::getline(words >> std::ws, call);
    if (what == "failed") run.failed = call;
    if (!run.failed.empty() && what != "failed") run.stack += line + "\n";
    if (what != "call") continue;
    run.points.push_back(n);
    run.calls.push_back(call);
  }
  return run;
}

std::vector<long> SomePoints(const std::vector<long>& points, std::size_t most) {
  if (points.size() <= most) return points;
  std::vector<long> some;
  for (std::size_t i = 0; i < most; ++i)
    some.push_back(points[i * (points.size() - 1) / std::max<std::size_t>(1, most - 1)]);
  return some;
}

bool FewFaults() { return std::getenv("LUMI_FEW_FAULTS") != nullptr; }

}  // namespace lumi
