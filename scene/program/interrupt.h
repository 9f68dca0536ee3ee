// Ctrl-C asks; long loops answer. A first SIGINT or SIGTERM sets a flag; CheckInterrupted throws, so that destructors
// remove what is half-written. A second one ends the program at once.
#pragma once

#include "scene/program/error.h"

namespace lumi {

void InstallInterruptHandler();
bool InterruptRequested();
inline void CheckInterrupted() {
  if (InterruptRequested()) throw Interrupted();
}

}  // namespace lumi
