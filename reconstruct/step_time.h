// How long a step took, children included: on a machine that does other work beside, the processor's seconds tell more
// than the clock's.
//
//   StepClock clock;
//   ... work ...
//   times.push_back(clock.Lap("features"));
#pragma once

#include <sys/resource.h>

#include <string>
#include <vector>

#include "scene/files/json_keys.h"
#include "scene/program/stopwatch.h"

namespace lumi {

struct StepTime {
  std::string name;        // features, matching, mapping, polishing
  double seconds = 0;      // by the clock
  double cpu_seconds = 0;  // of all threads and of the programs that were started
};
inline void ListKeys(JsonKeys& j, StepTime& s) {
  j("name", s.name, "seconds", s.seconds, "cpu_seconds", s.cpu_seconds);
}

class StepClock {
 public:
  // The step since it was made, or since its last lap.
  StepTime Lap(const std::string& name) {
    const double before = cpu_;
    cpu_ = CpuSeconds();
    return {name, watch_.Lap(), cpu_ - before};
  }

 private:
  static double CpuSeconds() {
    double seconds = 0;
    for (const auto who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
      rusage usage{};
      getrusage(who, &usage);
      for (const timeval& t : {usage.ru_utime, usage.ru_stime})
        seconds += static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    }
    return seconds;
  }
  Stopwatch watch_;
  double cpu_ = CpuSeconds();
};

}  // namespace lumi
