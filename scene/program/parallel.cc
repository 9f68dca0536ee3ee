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
#include <sanitizer/tsan_interface.h>
#endif

namespace lumi {
namespace {
std::unique_ptr<tbb::global_control> g_limit;
int g_threads = 0;

// ThreadSanitizer does not see how TBB, a library of the system, orders what threads do: what came before a loop comes
// before all of its parts, and these before what comes after. Nothing is said of the parts among themselves.
class LoopOrder {
 public:
  LoopOrder() { Release(&begin_); }
  ~LoopOrder() { Acquire(&end_); }
  LoopOrder(const LoopOrder&) = delete;
  LoopOrder& operator=(const LoopOrder&) = delete;
  template <typename Body>
  void Part(const Body& body) {
    struct End {
      char* end;
      ~End() { Release(end); }
    };
    Acquire(&begin_);
    const End end{&end_};
    body();
  }

 private:
#ifdef __SANITIZE_THREAD__
  static void Acquire(char* at) { __tsan_acquire(at); }
  static void Release(char* at) { __tsan_release(at); }
#else
  static void Acquire(char*) {}
  static void Release(char*) {}
#endif
  char begin_ = 0, end_ = 0;
};
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
  LoopOrder order;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain > 0 ? grain : 1),
                    [&](const tbb::blocked_range<std::size_t>& r) { order.Part([&] { body(r.begin(), r.end()); }); });
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
        // What `make` runs in parallel itself may not begin another of these workers while it waits.
        tbb::this_task_arena::isolate([&] { make(i); });
        const std::lock_guard lock(taking);
        made[i] = 1;
        for (; !ended && taken < count && made[taken]; ++taken) take(taken);
      }
    } catch (...) {
      ended = true;
      throw;
    }
  };
  const auto workers = static_cast<std::size_t>(ThreadCount());
  LoopOrder order;
  tbb::parallel_for(
      std::size_t{0}, std::min(workers, count), [&](std::size_t) { order.Part(work); }, tbb::simple_partitioner());
}

}  // namespace lumi
