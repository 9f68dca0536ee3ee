// Loops that are written for a register's width, where the compiler does not find it by itself: one template over the
// width, instantiated in a function for each kind of machine, and the widest that runs here is called. (A vector wider
// than the machine's is taken apart number by number, so LUMI_KERNEL's one width for all will not do.)
//
//   template <int kBytes> LUMI_INLINE void Sum(...) { using V = Register<kBytes>::Floats; ... }
//   LUMI_WITH_64 void Sum64(...) { Sum<64>(...); }      likewise 32 and 16
//   WidestRegister() == 64 ? Sum64 : WidestRegister() == 32 ? Sum32 : Sum16
//
// The file is compiled with -Wno-psabi: these vectors are passed to inlined functions only.
#pragma once

#include <cstdint>
#include <cstring>

#include "scene/program/kernel.h"

#if defined(__x86_64__) && !defined(__clang__) && !defined(LUMI_NO_TARGET_CLONES)
#define LUMI_WITH_64 __attribute__((target("arch=x86-64-v4")))
#define LUMI_WITH_32 __attribute__((target("arch=x86-64-v3")))
#else
#define LUMI_WITH_64
#define LUMI_WITH_32
#endif
#define LUMI_WITH_16

namespace lumi {

// They hold the same bytes. (Not one template: the attribute takes no size that depends on one.)
template <int kBytes>
struct Register;
#define LUMI_REGISTER(kBytes)                                         \
  template <>                                                         \
  struct Register<kBytes> {                                           \
    using Floats = float __attribute__((vector_size(kBytes)));        \
    using Doubles = double __attribute__((vector_size(kBytes)));      \
    using Ints = std::int32_t __attribute__((vector_size(kBytes)));   \
    using Pairs = std::uint64_t __attribute__((vector_size(kBytes))); \
    static constexpr int kNumbers = kBytes / 4;                       \
  };
LUMI_REGISTER(64)
LUMI_REGISTER(32)
LUMI_REGISTER(16)
#undef LUMI_REGISTER

// From and to any address.
template <class V, class T>
LUMI_INLINE V LoadRegister(const T* from) {
  V v;
  std::memcpy(&v, from, sizeof(V));
  return v;
}
template <class V, class T>
LUMI_INLINE void StoreRegister(V v, T* to) {
  std::memcpy(to, &v, sizeof(V));
}

// Bytes of the widest that this machine has: 64 (AVX-512), 32 (AVX2) or 16.
inline int WidestRegister() {
#if defined(__x86_64__) && !defined(__clang__) && !defined(LUMI_NO_TARGET_CLONES)
  static const int widest = __builtin_cpu_supports("x86-64-v4") ? 64 : __builtin_cpu_supports("x86-64-v3") ? 32 : 16;
  return widest;
#else
  return 16;
#endif
}

}  // namespace lumi
