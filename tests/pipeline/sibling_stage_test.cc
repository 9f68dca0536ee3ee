#include "pipeline/sibling_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/child_progress.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

TEST(ProgressLine, IsReadWithSpacesInTheTask) {
  const auto line = ParseProgressLine("@progress 3 55 matching pairs of photos");
  ASSERT_TRUE(line);
  EXPECT_EQ(line->done, 3);
  EXPECT_EQ(line->total, 55);
  EXPECT_EQ(line->task, "matching pairs of photos");
}

TEST(ProgressLine, UnknownTotalsAreKept) {
  const auto line = ParseProgressLine("@progress 7 0 reading frames");
  ASSERT_TRUE(line);
  EXPECT_EQ(line->total, 0);
}

TEST(ProgressLine, OtherLinesAreNone) {
  for (const char* line :
       {"", "@progress", "@progress x 5 task", "progress 1 2 task", "a remark about @progress 1 2 x"})
    EXPECT_FALSE(ParseProgressLine(line)) << line;
}

// Shell scripts in PATH stand for stages.
class Stage : public testing::Test {
 protected:
  Stage() : path_(::getenv("PATH")) { ::setenv("PATH", (folder_.path().string() + ":" + path_).c_str(), 1); }
  ~Stage() override { ::setenv("PATH", path_.c_str(), 1); }
  StageResult Run(const std::string& script, ProgressSink& sink = SilentProgress()) {
    const auto file = folder_ / "fake-stage";
    WriteTextAtomically(file, "#!/bin/sh\n" + script + "\n");
    std::filesystem::permissions(file, std::filesystem::perms::owner_all);
    return RunSiblingStage({"proxy", "fake-stage", {"a b"}, 2, 5}, sink);
  }
  TemporaryFolder folder_;
  const std::string path_;
};

class Recorder : public ProgressSink {
 public:
  void Report(const std::string& task, long done, long total, double, double) override {
    lines.push_back(task + " " + std::to_string(done) + "/" + std::to_string(total));
  }
  void Finish(const std::string& task, long, double) override { lines.push_back("end of " + task); }
  void Message(const std::string& line) override { lines.push_back(line); }
  std::vector<std::string> lines;
};

TEST_F(Stage, ShowsTheProgramsProgressUnderItsNumber) {
  Recorder recorder;
  const StageResult result =
      Run("echo \"@progress 1 4 cutting $1\" >&2; echo 'a remark' >&2; echo '@progress 2 2 saving' >&2; echo "
          "'{\"faces\": 12}'",
          recorder);
  EXPECT_THAT(recorder.lines, testing::ElementsAre("stage 2/5 proxy: cutting a b 1/4", "proxy: a remark",
                                                   "end of stage 2/5 proxy: cutting a b", "stage 2/5 proxy: saving 2/2",
                                                   "end of stage 2/5 proxy: saving"));
  EXPECT_EQ(result.summary.Text(), "{\"faces\":12}");
  EXPECT_FALSE(result.reused);
}

TEST_F(Stage, SaysWhatWasReused) {
  EXPECT_TRUE(Run("echo '{\"reused\": true}'").reused);
  EXPECT_TRUE(Run("echo '{\"reused\": [\"everything\"]}'").reused);
  EXPECT_FALSE(Run("echo '{\"reused\": [\"features\"]}'").reused);
  EXPECT_FALSE(Run("echo '{\"reused\": []}'").reused);
}

TEST_F(Stage, AFailureIsThrownAsTheProgramToldIt) {
  try {
    Run("echo 'fake-stage: x.ply: is no mesh (make it anew)' >&2; "
        "echo '{\"error\": {\"code\": 3, \"file\": \"x.ply\", \"message\": \"is no mesh\", \"hint\": \"make it "
        "anew\"}}'; exit 3");
    FAIL() << "nothing was thrown";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kCorruptInput);
    EXPECT_EQ(std::string(e.what()), "proxy: is no mesh");
    EXPECT_EQ(e.file(), "x.ply");
    EXPECT_EQ(e.hint(), "make it anew");
  }
}

TEST_F(Stage, AProgramThatDiesWithoutAWordIsTold) {
  const auto code_of = [&](const std::string& script) {
    try {
      Run(script);
    } catch (const Error& e) {
      return e.code();
    }
    return ExitCode::kDone;
  };
  EXPECT_EQ(code_of("kill -9 $$"), ExitCode::kMachine);
  EXPECT_EQ(code_of("kill -11 $$"), ExitCode::kBug);
  EXPECT_EQ(code_of("exit 130"), ExitCode::kInterrupted);
  EXPECT_EQ(code_of("echo no JSON; exit 1"), ExitCode::kBug);
  EXPECT_EQ(code_of("echo no JSON"), ExitCode::kBug);
}

}  // namespace
}  // namespace lumi
