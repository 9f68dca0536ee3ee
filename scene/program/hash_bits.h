// Pseudo-random bits as a function of their input alone, not of the order of calls: the same on any thread.
#pragma once

#include <cstdint>

namespace lumi {

// Mixes 32 bits so that neighbouring inputs share nothing (Wellons' "lowbias32").
inline std::uint32_t HashBits(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352dU;
  x ^= x >> 15;
  x *= 0x846ca68bU;
  x ^= x >> 16;
  return x;
}

}  // namespace lumi
