// A register's worth of numbers, one ray in each: what the optimum's kernels are written in. As wide as the machine's
// registers: what is wider the compiler splits, and badly (GCC 12 goes through memory for every comparison).
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>

namespace lumi {

template <class T, int kBytes>
struct LaneTypes {
  static_assert(sizeof(T) == 4 || sizeof(T) == 8);
  typedef T V __attribute__((vector_size(kBytes)));
};
template <class T, int kBytes>
using Lanes = typename LaneTypes<T, kBytes>::V;
template <class T, int kBytes>
constexpr int kLaneCount = kBytes / static_cast<int>(sizeof(T));

// Of a V = Lanes<T, kBytes>: T, the integers of its width, and how many.
template <class V>
using LaneValue = std::remove_cvref_t<decltype(std::declval<V&>()[0])>;
template <class V>
using LaneIntegers =
    Lanes<std::conditional_t<sizeof(LaneValue<V>) == 4, std::int32_t, std::int64_t>, static_cast<int>(sizeof(V))>;
template <class V>
constexpr int kLanesOf = static_cast<int>(sizeof(V) / sizeof(LaneValue<V>));

}  // namespace lumi
