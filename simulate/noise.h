// Pseudo-random numbers as a function of their arguments alone, not of the order of calls: hashes of integers and
// gradient noise (Perlin 1985, 2002). The same arguments give the same value on any thread, so a capture does not
// depend on the thread count.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "scene/program/hash_bits.h"

namespace lumi {

inline std::uint32_t HashBits(std::uint32_t a, std::uint32_t b) { return HashBits(a ^ (HashBits(b) + 0x9e3779b9U)); }
inline std::uint32_t HashBits(std::uint32_t a, std::uint32_t b, std::uint32_t c) { return HashBits(a, HashBits(b, c)); }
inline std::uint32_t HashBits(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  return HashBits(a, HashBits(b, c, d));
}

// In [0, 1).
inline double UnitFromBits(std::uint32_t bits) { return bits * (1.0 / 4294967296.0); }

// A short stream of random numbers, begun anywhere.
class HashStream {
 public:
  HashStream(std::uint64_t seed, std::uint32_t a, std::uint32_t b = 0)
      : state_(HashBits(static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32), a, b)) {}
  std::uint32_t Bits() { return HashBits(state_, ++count_); }
  double Uniform() { return UnitFromBits(Bits()); }
  double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  double Gaussian() {  // Box and Muller
    const double u = 1.0 - Uniform(), v = Uniform();
    return std::sqrt(-2.0 * std::log(u)) * std::cos(6.283185307179586 * v);
  }

 private:
  std::uint32_t state_;
  std::uint32_t count_ = 0;
};

// Gradient noise in about [-1, 1], features of size 1.
float GradientNoise(const Eigen::Vector3f& x, std::uint32_t seed);

// Octaves of gradient noise, each half the size and `gain` times the strength of the one before, in about [-1, 1].
// Octaves finer than `footprint` (same units as x) are left out: they would alias.
float FractalNoise(const Eigen::Vector3f& x, int octaves, float gain, float footprint, std::uint32_t seed);

}  // namespace lumi
