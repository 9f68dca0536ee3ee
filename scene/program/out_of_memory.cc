#include "scene/program/out_of_memory.h"

#include <atomic>
#include <new>

namespace lumi {
namespace {

std::atomic<bool> g_out_of_memory{false};

void NoteOutOfMemory() {
  g_out_of_memory = true;
  throw std::bad_alloc();
}

}  // namespace

void WatchAllocations() { std::set_new_handler(NoteOutOfMemory); }

bool MemoryRanOut() { return g_out_of_memory; }

void ThrowIfMemoryRanOut() {
  if (g_out_of_memory) throw std::bad_alloc();
}

void MemoryIsBack() { g_out_of_memory = false; }

}  // namespace lumi
