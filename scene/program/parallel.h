// Loops over all cores, parallel by default. Work is split by range; results must not depend on the split.
#pragma once

#include <cstddef>
#include <functional>

namespace lumi {

// 0: all cores. Applies to everything after it in this process (ParallelFor, OpenCV, OpenImageIO).
void SetThreadCount(int threads);
int ThreadCount();

// body(begin, end) over [0, count) in chunks of at least `grain`. Exceptions of a body end the loop and are rethrown.
void ParallelFor(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body);

// make(i) over [0, count) in parallel, and take(i) as soon as all up to i are made: one at a time, 0, 1, 2 ... For
// results that are written while others are computed: however the loop ends, the results written are the first ones,
// without a gap. An exception of either function ends the loop after the items in progress, and is rethrown.
void ParallelInOrder(std::size_t count, const std::function<void(std::size_t)>& make,
                     const std::function<void(std::size_t)>& take);

}  // namespace lumi
