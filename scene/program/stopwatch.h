#pragma once

#include <chrono>

namespace lumi {

inline double SecondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Seconds since it was made, or since its last lap.
class Stopwatch {
 public:
  double Seconds() const { return SecondsSince(start_); }
  double Lap() {  // what it shows; it starts anew
    const double seconds = Seconds();
    start_ = std::chrono::steady_clock::now();
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace lumi
