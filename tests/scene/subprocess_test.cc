#include "scene/program/subprocess.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "scene/program/error.h"

namespace lumi {
namespace {

TEST(Subprocess, LinesComeAsTheyAreWrittenAndTheExitCodeIsKept) {
  std::vector<std::string> lines;
  SubprocessOptions options;
  options.on_line = [&](const std::string& line) { lines.push_back(line); };
  const auto r = RunSubprocess({"sh", "-c", "echo one; echo two >&2; printf 'a\\rb'; exit 3"}, options);
  EXPECT_EQ(r.exit_code, 3);
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[0], "one");
  EXPECT_EQ(lines[3], "b");
  EXPECT_EQ(r.tail, lines);
}

TEST(Subprocess, StdoutCanBeKeptApart) {
  SubprocessOptions options;
  options.separate_stdout = true;
  options.environment["LUMI_TEST_VALUE"] = "seven";
  const auto r = RunSubprocess({"sh", "-c", "echo $LUMI_TEST_VALUE; echo noise >&2"}, options);
  EXPECT_EQ(r.out, "seven\n");
  EXPECT_EQ(r.tail, std::vector<std::string>{"noise"});
}

TEST(Subprocess, AKilledChildTellsItsSignalAndAMissingProgramIsNamed) {
  EXPECT_EQ(RunSubprocess({"sh", "-c", "kill -9 $$"}).exit_code, 128 + 9);
  try {
    RunSubprocess({"no-such-program-anywhere"});
    FAIL();
  } catch (const MachineError& e) {
    EXPECT_NE(std::string(e.what()).find("no-such-program-anywhere"), std::string::npos);
  }
}

TEST(Subprocess, ACallbackThatThrowsEndsTheChild) {
  SubprocessOptions options;
  options.on_line = [](const std::string&) { throw DataError("enough"); };
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THROW(RunSubprocess({"sh", "-c", "echo x; sleep 30"}, options), DataError);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));
}

// Many at once, which speak and end at about the moment when we look whether they have ended (every 200 ms).
TEST(Subprocess, TheLastWordsAreReadWhateverTheMoment) {
  std::atomic<int> lost = 0;
  std::vector<std::jthread> threads;
  for (int i = 0; i < 150; ++i)
    threads.emplace_back([&lost, i] {
      SubprocessOptions options;
      options.separate_stdout = true;
      for (int k = 0; k < 3; ++k)
        if (const auto r = RunSubprocess(
                {"sh", "-c", "sleep 0." + std::to_string(185 + (7 * i + 3 * k) % 30) + "; echo said"}, options);
            r.out != "said\n")
          ++lost;
    });
  threads.clear();
  EXPECT_EQ(lost, 0);
}

}  // namespace
}  // namespace lumi
