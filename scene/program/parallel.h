// Cores are for use: parallel by default. Work is split by range, results must not depend on the split.
#pragma once

#include <cstddef>
#include <functional>

namespace lumi {

// 0: all cores. Applies to everything after it in this process (ParallelFor, OpenCV, OpenImageIO).
void SetThreadCount(int threads);
int ThreadCount();

// body(begin, end) over [0, count) in chunks of at least `grain`. Exceptions of a body end the loop and are rethrown.
void ParallelFor(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body);

}  // namespace lumi
