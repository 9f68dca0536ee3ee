#include "scene/program/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>

#include <memory>
#include <opencv2/core/utility.hpp>

namespace lumi {
namespace {
std::unique_ptr<tbb::global_control> g_limit;
int g_threads = 0;
}  // namespace

void SetThreadCount(int threads) {
  g_threads = threads;
  g_limit.reset();
  if (threads > 0)
    g_limit = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                    static_cast<std::size_t>(threads));
  cv::setNumThreads(threads > 0 ? threads : -1);
}

int ThreadCount() { return g_threads > 0 ? g_threads : tbb::info::default_concurrency(); }

void ParallelFor(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body) {
  if (count == 0) return;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain > 0 ? grain : 1),
                    [&](const tbb::blocked_range<std::size_t>& r) { body(r.begin(), r.end()); });
}

}  // namespace lumi
