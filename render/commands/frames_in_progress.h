// Frames that are coded while the next ones are drawn: coding one takes one core, and on a graphics processor, or many
// cores, longer than drawing it.
#pragma once

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
  // which they are added. Waits while as many are in progress as may be. Rethrows what earlier ones threw.
  template <typename Code, typename Take>
  void Add(Code code, Take take) {
    while (running_.size() >= at_once_) Wait();
    std::shared_future<void> before;
    if (!running_.empty()) before = running_.back();
    running_.push_back(
        std::async(threads_ ? std::launch::async : std::launch::deferred, [before, code = std::move(code),
                                                                           take = std::move(take)]() mutable {
          auto coded = code();
          if (before.valid()) before.get();
          take(std::move(coded));
        }).share());
    if (!threads_) Wait();
  }
  // Until all are done; rethrows what the first that failed threw.
  void Finish() {
    while (!running_.empty()) Wait();
  }

 private:
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
