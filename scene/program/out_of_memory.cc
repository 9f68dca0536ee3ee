#include "scene/program/out_of_memory.h"

#include <signal.h>

#include <atomic>
#include <exception>
#include <new>

namespace lumi {
namespace {

std::atomic<bool> g_out_of_memory{false};
void (*g_crashed)(int) = nullptr;

void HandleCrashes(void (*handler)(int)) {
  for (const int crash : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) ::signal(crash, handler);
}

void Note() {
  if (!g_out_of_memory.exchange(true)) HandleCrashes(g_crashed);
}

void NoteOutOfMemory() {
  Note();
  throw std::bad_alloc();
}

void EndOutOfMemory() {
  Note();
  std::terminate();
}

}  // namespace

EndsWhereMemoryRunsOut::EndsWhereMemoryRunsOut() : watched_(std::get_new_handler() == NoteOutOfMemory) {
  if (watched_) std::set_new_handler(EndOutOfMemory);
}

EndsWhereMemoryRunsOut::~EndsWhereMemoryRunsOut() {
  if (watched_) std::set_new_handler(NoteOutOfMemory);
}

void WatchAllocations(void (*crashed)(int signal)) {
  g_crashed = crashed;
  std::set_new_handler(NoteOutOfMemory);
}

bool MemoryRanOut() { return g_out_of_memory; }

void ThrowIfMemoryRanOut() {
  if (g_out_of_memory) throw std::bad_alloc();
}

void MemoryIsBack() {
  if (g_out_of_memory.exchange(false)) HandleCrashes(SIG_DFL);
}

}  // namespace lumi
