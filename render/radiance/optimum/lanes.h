// A register's worth of numbers, one ray in each: what the optimum's kernels are written in. 64 bytes wide; compiled for
// narrower machines an operation becomes two or four.
#pragma once

#include <cstdint>

namespace lumi {

template <class T>
struct LaneTypes;
template <>
struct LaneTypes<float> {
  typedef float V __attribute__((vector_size(64)));
  typedef std::int32_t I __attribute__((vector_size(64)));
};
template <>
struct LaneTypes<double> {
  typedef double V __attribute__((vector_size(64)));
  typedef std::int64_t I __attribute__((vector_size(64)));
};
template <class T>
using Lanes = typename LaneTypes<T>::V;
template <class T>
constexpr int kLaneCount = static_cast<int>(64 / sizeof(T));

}  // namespace lumi
