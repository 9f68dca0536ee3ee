#include "scene/program/interrupt.h"

#include <unistd.h>
#include <csignal>

namespace lumi {
namespace {

volatile std::sig_atomic_t g_requested = 0;

void OnSignal(int) {
  if (g_requested) _exit(static_cast<int>(ExitCode::kInterrupted));
  g_requested = 1;
}

}  // namespace

void InstallInterruptHandler() {
  struct sigaction action = {};
  action.sa_handler = OnSignal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = 0;  // no SA_RESTART: a blocked read returns, and the loop around it looks at the flag
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
}

bool InterruptRequested() { return g_requested != 0; }

}  // namespace lumi
