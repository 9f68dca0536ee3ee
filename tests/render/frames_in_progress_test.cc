#include "render/commands/frames_in_progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <vector>

namespace lumi {
namespace {

// Ends when two have come, or after a while.
class MeetingOfTwo {
 public:
  bool Come() {
    std::unique_lock lock(mutex_);
    ++here_;
    both_.notify_all();
    return both_.wait_for(lock, std::chrono::seconds(20), [&] { return here_ >= 2; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable both_;
  int here_ = 0;
};

TEST(FramesInProgress, AreCodedAtTheSameTime) {
  MeetingOfTwo meeting;
  std::atomic<int> met = 0;
  FramesInProgress frames(2, true);
  for (int i = 0; i < 2; ++i) frames.Add([&] { return meeting.Come(); }, [&](bool came) { met += came; });
  frames.Finish();
  EXPECT_EQ(met, 2);
}

TEST(FramesInProgress, AreTakenInOrderAndNoMoreAtOnceThanMayBe) {
  for (const bool threads : {false, true}) {
    std::atomic<int> running = 0, most = 0;
    std::vector<int> taken;
    FramesInProgress frames(4, threads);
    for (int i = 0; i < 400; ++i)
      frames.Add(
          [&, i] {
            const int now = ++running;
            for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
            }
            --running;
            return i;
          },
          [&](int value) { taken.push_back(value); });
    frames.Finish();
    EXPECT_EQ(taken.size(), 400U);
    EXPECT_TRUE(std::ranges::is_sorted(taken));
    EXPECT_LE(most, threads ? 4 : 1);
  }
}

// The pictures themselves: those in progress, and the one that is added.
TEST(FramesInProgress, PicturesAreReleasedWhenTheyAreCoded) {
  constexpr int kAtOnce = 3;
  std::atomic<int> alive = 0, most = 0;
  struct Picture {
    explicit Picture(std::atomic<int>& alive) : alive(alive) { ++alive; }
    ~Picture() { --alive; }
    Picture(const Picture&) = delete;
    Picture& operator=(const Picture&) = delete;
    std::atomic<int>& alive;
  };
  FramesInProgress frames(kAtOnce, true);
  for (int i = 0; i < 500; ++i) {
    auto picture = std::make_shared<Picture>(alive);
    most = std::max(most.load(), alive.load());
    frames.Add([picture = std::move(picture)] { return picture->alive.load(); }, [](int) {});
  }
  frames.Finish();
  EXPECT_LE(most, kAtOnce + 1);
  EXPECT_EQ(alive, 0);
}

TEST(FramesInProgress, WhatIsTakenBeforeAFailureHasNoGap) {
  std::vector<int> taken;
  FramesInProgress frames(3, true);
  const auto add_all = [&] {
    for (int i = 0; i < 20; ++i)
      frames.Add(
          [i] {
            if (i == 7) throw std::runtime_error("the disk is full");
            return i;
          },
          [&](int value) { taken.push_back(value); });
    frames.Finish();
  };
  EXPECT_THROW(add_all(), std::runtime_error);
  EXPECT_EQ(taken, (std::vector{0, 1, 2, 3, 4, 5, 6}));
}

}  // namespace
}  // namespace lumi
