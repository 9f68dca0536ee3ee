#include "scene/program/progress.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <thread>
#include <vector>

#include "scene/program/memory.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

struct Recorder : ProgressSink {
  std::vector<std::pair<long, long>> reports;
  long finished = -1;
  double left = 0;
  void Report(const std::string&, long done, long total, double, double seconds_left) override {
    reports.emplace_back(done, total);
    left = seconds_left;
  }
  void Finish(const std::string&, long done, double) override { finished = done; }
  void Message(const std::string&) override {}
};

TEST(Progress, StepsFromManyThreadsAreAllCounted) {
  Recorder sink;
  {
    Progress progress(sink, "work", 1000);
    ParallelFor(1000, 10, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) progress.Step();
    });
  }
  EXPECT_EQ(sink.finished, 1000);
  EXPECT_EQ(sink.reports.front(), std::make_pair(0L, 1000L));
  EXPECT_EQ(sink.reports.back().first, 1000);
}

TEST(Progress, TimeLeftIsProportional) {
  Recorder sink;
  Progress progress(sink, "work", 4);
  std::this_thread::sleep_for(std::chrono::milliseconds(150));
  progress.Step();
  EXPECT_GE(sink.left, 3 * 0.15);
}

TEST(ParallelInOrder, TakesEachInTurnAndPassesExceptionsOn) {
  for (const int threads : {1, 3, 0}) {
    SetThreadCount(threads);
    std::vector<std::atomic<int>> made(400);
    std::vector<std::size_t> taken;
    ParallelInOrder(
        made.size(),
        [&](std::size_t i) {
          // Work that is split further, of different lengths.
          ParallelFor(1 + i % 7, 1, [&](std::size_t begin, std::size_t end) {
            for (std::size_t k = begin; k < end; ++k) std::this_thread::sleep_for(std::chrono::microseconds(20));
          });
          ++made[i];
        },
        [&](std::size_t i) {
          EXPECT_EQ(made[i], 1);
          taken.push_back(i);
        });
    std::vector<std::size_t> all(made.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    EXPECT_EQ(taken, all);

    taken.clear();
    const auto fail_at = [](std::size_t at) {
      return [at](std::size_t i) {
        if (i == at) throw std::runtime_error("no more");
      };
    };
    EXPECT_THROW(ParallelInOrder(100, fail_at(30), [&](std::size_t i) { taken.push_back(i); }), std::runtime_error);
    all.resize(taken.size());
    EXPECT_EQ(taken, all);
    EXPECT_LE(taken.size(), 30U);
    EXPECT_THROW(ParallelInOrder(
                     100, [](std::size_t) {}, fail_at(30)),
                 std::runtime_error);
    ParallelInOrder(0, fail_at(0), fail_at(0));
  }
  SetThreadCount(0);
}

// Bodies that together would take more than there is run one after the other; small ones need not wait.
TEST(MemoryTurn, GoesOnOnlyWithWhatFits) {
  constexpr std::uint64_t kAll = std::uint64_t{1} << 62;
  SetThreadCount(4);
  std::atomic<int> inside{0}, most{0}, done{0};
  ParallelFor(40, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const MemoryTurn turn(kAll);
      const MemoryTurn small(1000);
      most = std::max(most.load(), ++inside);
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      --inside;
      ++done;
    }
  });
  SetThreadCount(0);
  EXPECT_EQ(most, 1);
  EXPECT_EQ(done, 40);
  // Two that fit into it together do not wait for each other: this would never end.
  const MemoryTurn one(AvailableMemory() / 8);
  const MemoryTurn other(AvailableMemory() / 8);
}

TEST(ParallelFor, CoversTheRangeOnceAndPassesExceptionsOn) {
  std::vector<std::atomic<int>> hits(5000);
  ParallelFor(hits.size(), 7, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) ++hits[i];
  });
  for (const auto& h : hits) ASSERT_EQ(h, 1);
  EXPECT_THROW(ParallelFor(100, 1,
                           [](std::size_t begin, std::size_t) {
                             if (begin > 50) throw std::runtime_error("x");
                           }),
               std::runtime_error);
}

}  // namespace
}  // namespace lumi
