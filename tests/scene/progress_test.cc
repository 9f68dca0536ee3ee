#include "scene/program/progress.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>
#include <thread>
#include <vector>

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
