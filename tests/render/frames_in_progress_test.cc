#include "render/commands/frames_in_progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

namespace lumi {
namespace {

TEST(FramesInProgress, AreCodedAtTheSameTimeAndTakenInOrder) {
  for (const bool threads : {false, true}) {
    std::atomic<int> running = 0, most = 0;
    std::vector<int> taken;
    FramesInProgress frames(4, threads);
    for (int i = 0; i < 40; ++i)
      frames.Add(
          [&, i] {
            const int now = ++running;
            for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
            }
            // Those in between are ready first.
            if (i % 4 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
            --running;
            return i;
          },
          [&](int value) { taken.push_back(value); });
    frames.Finish();
    EXPECT_EQ(taken.size(), 40U);
    EXPECT_TRUE(std::ranges::is_sorted(taken));
    EXPECT_LE(most, threads ? 4 : 1);
  }
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
