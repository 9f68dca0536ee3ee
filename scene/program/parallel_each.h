// Each of many, in parallel. Ctrl-C ends it between two of them.
//
//   ParallelEach(photos.size(), 1, [&](std::size_t i) { photos[i] = Read(files[i]); });
#pragma once

#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {

// each(i) for i in [0, count), at least `grain` of them in a row by one thread. Exceptions as with ParallelFor.
template <typename Each>
void ParallelEach(std::size_t count, std::size_t grain, const Each& each) {
  ParallelFor(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      CheckInterrupted();
      each(i);
    }
  });
  CheckInterrupted();  // Ctrl-C may have come during the last ones
}

}  // namespace lumi
