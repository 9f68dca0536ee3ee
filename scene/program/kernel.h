// For loops over arrays of floats that must vectorise: compiled for x86-64-v4, v3 and the baseline, picked when the
// program starts, so that one binary runs everywhere (and under valgrind). The file that holds such a loop is compiled
// with -fno-math-errno -fno-trapping-math, or square roots and comparisons keep it from vectorising.
#pragma once

#if defined(LUMI_NO_TARGET_CLONES) || !defined(__x86_64__) || defined(__clang__)
#define LUMI_KERNEL
#else
#define LUMI_KERNEL __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#endif

// What a kernel is made of: must be inlined to be compiled for the kernel's own instruction set.
#define LUMI_INLINE [[gnu::always_inline]] inline
