// Descriptors of one byte a number, matched by brute force as COLMAP's matcher does it on a CPU: each other's nearest
// by angle, with a ratio test both ways. All products of two photos' descriptors are formed once, in integers, and both
// ways are read from them.
//
//   const auto matches = MatchBytes(a, b, {});        // a, b: SIFT, 512 times a unit vector
//
// Same descriptors, same matches, on every processor and by any number of threads: integers know no rounding, and of
// several that are as near the first counts, which the ratio test then refuses.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace lumi {

inline constexpr int kByteDescriptorLength = 128;
// Shape (features, 128).
using ByteDescriptors = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// COLMAP's own bounds.
struct ByteMatchOptions {
  double max_ratio = 0.8;                                        // angle to the nearest over angle to the second, below
  double max_distance_rad = 0.7;                                 // angle to the nearest, at most
  Eigen::Index most = std::numeric_limits<Eigen::Index>::max();  // of the first so many features of each
};

// What the products are formed with. kPortable is plain C++.
enum class ByteKernel { kPortable, kAvx2, kAvx512Vnni };
// What this processor can do, the fastest last.
std::vector<ByteKernel> AvailableByteKernels();
std::string Name(ByteKernel kernel);

// Positions in a and b, by a ascending. Throws UsageError where a row is not of 128 numbers.
std::vector<std::pair<int, int>> MatchBytes(const ByteDescriptors& a, const ByteDescriptors& b,
                                            const ByteMatchOptions& options);
// With one of AvailableByteKernels(): for tests and measurements.
std::vector<std::pair<int, int>> MatchBytes(const ByteDescriptors& a, const ByteDescriptors& b,
                                            const ByteMatchOptions& options, ByteKernel kernel);

}  // namespace lumi
