#include "scene/program/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <vector>

#ifdef __SANITIZE_THREAD__
#include <exception>
#include <thread>
#endif

namespace lumi {
namespace {
std::unique_ptr<tbb::global_control> g_limit;
int g_threads = 0;

#ifdef __SANITIZE_THREAD__
// ThreadSanitizer does not see how TBB, a library of the system, orders what threads do: where it checks, a loop runs
// on threads of its own.
void Loop(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body) {
  std::atomic<std::size_t> next{0};
  std::mutex failing;
  std::exception_ptr failure;
  const auto work = [&] {
    try {
      for (std::size_t begin; (begin = next.fetch_add(grain)) < count;) body(begin, std::min(count, begin + grain));
    } catch (...) {
      next = count;
      const std::lock_guard lock(failing);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> threads;
    const std::size_t parts = std::min(static_cast<std::size_t>(ThreadCount()), (count + grain - 1) / grain);
    for (std::size_t t = 1; t < parts; ++t) threads.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
}
template <typename Body>
void Alone(const Body& body) {
  body();
}
#else
void Loop(std::size_t count, std::size_t grain, const std::function<void(std::size_t, std::size_t)>& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain),
                    [&](const tbb::blocked_range<std::size_t>& r) { body(r.begin(), r.end()); });
}
// While a parallel loop inside `body` waits, its thread must not begin another part of the loop that `body` belongs to.
template <typename Body>
void Alone(const Body& body) {
  tbb::this_task_arena::isolate(body);
}
#endif
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
  if (count > 0) Loop(count, grain > 0 ? grain : 1, body);
}

void ParallelInOrder(std::size_t count, const std::function<void(std::size_t)>& make,
                     const std::function<void(std::size_t)>& take) {
  std::atomic<std::size_t> next{0};
  std::atomic<bool> ended{false};
  std::mutex taking;
  std::vector<char> made(count, 0);
  std::size_t taken = 0;
  const auto work = [&] {
    try {
      for (std::size_t i; !ended && (i = next++) < count;) {
        Alone([&] { make(i); });
        const std::lock_guard lock(taking);
        made[i] = 1;
        for (; !ended && taken < count && made[taken]; ++taken) take(taken);
      }
    } catch (...) {
      ended = true;
      throw;
    }
  };
  const auto workers = std::min(static_cast<std::size_t>(ThreadCount()), count);
  if (workers > 0)
    Loop(workers, 1, [&](std::size_t begin, std::size_t end) {
      for (; begin < end; ++begin) work();
    });
}

}  // namespace lumi
