// Frames that are coded while the next ones are drawn: coding one takes one core, and on a graphics processor, or many
// cores, longer than drawing it.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <future>
#include <utility>

namespace lumi {

class FramesInProgress {
 public:
  // at_once > 0: so many are coded at the same time. `threads` false: each by the caller, as it is added.
  FramesInProgress(std::size_t at_once, bool threads) : at_once_(threads ? at_once : 1), threads_(threads) {}

  // code() beside what the caller does next, and then take(what it gave), one frame after the other, in the order in
  // which they are added. Waits while as many are in progress as may be. Rethrows what earlier ones threw. What code()
  // holds is released when it has ended; what `take` refers to must outlive this object.
  template <typename Code, typename Take>
  void Add(Code code, Take take) {
    while (!running_.empty() && (running_.size() >= at_once_ || IsReady(running_.front()))) Wait();
    std::shared_future<void> before;
    if (!running_.empty()) before = running_.back();
    running_.push_back(
        std::async(threads_ ? std::launch::async : std::launch::deferred, [before = std::move(before),
                                                                           code = std::move(code),
                                                                           take = std::move(take)]() mutable {
          // A future keeps this closure, and each of them the future before: what they
          // hold would stay until the last frame.
          const std::shared_future<void> earlier = std::move(before);
          auto coded = Code(std::move(code))();
          if (earlier.valid()) earlier.get();
          take(std::move(coded));
        }).share());
    if (!threads_) Wait();
  }
  // Until all are done; rethrows what the first that failed threw.
  void Finish() {
    while (!running_.empty()) Wait();
  }

 private:
  static bool IsReady(const std::shared_future<void>& f) {
    return f.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  }
  void Wait() {
    const std::shared_future<void> first = std::move(running_.front());
    running_.pop_front();
    first.get();
  }

  std::size_t at_once_;
  bool threads_;
  std::deque<std::shared_future<void>> running_;
};

}  // namespace lumi
