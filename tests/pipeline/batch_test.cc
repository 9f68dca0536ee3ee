#include "pipeline/batch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>

#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// Answers at once, but for captures whose name begins with "bad" or "full"; waits until `together` are there.
struct Pretended final : Executor {
  explicit Pretended(int together) : wanted(together) {}
  SiblingAnswer Run(const ExecutedStage& stage, ProgressSink& progress) override {
    {
      const std::lock_guard lock(mutex);
      lines.push_back(stage.sibling.arguments);
    }
    ++here;
    while (here < wanted) std::this_thread::yield();
    progress.Message("made");
    if (stage.name.starts_with("bad")) throw DataError("nothing to see", "take more", stage.sibling.arguments[0]);
    if (stage.name.starts_with("full")) throw MachineError("no space left");
    return {JsonKeys(), 2.5};
  }
  std::vector<SiblingAnswer> RunAll(const std::vector<ExecutedStage>&, const std::string&, ProgressSink&) override {
    ADD_FAILURE() << "captures are jobs of their own";
    return {};
  }
  const int wanted;
  std::atomic<int> here = 0;
  std::mutex mutex;
  std::vector<std::vector<std::string>> lines;
};

class Batch : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"first", "bad.one", "with space", "full"}) fs::create_directories(folder_ / "in" / name);
    WriteTextAtomically(folder_ / "in" / "film.mp4", "x");
  }
  fs::path List(const std::string& text) {
    WriteTextAtomically(folder_ / "in" / "list.txt", text);
    return folder_ / "in" / "list.txt";
  }
  std::string Refused(const std::string& text) {
    try {
      ReadBatch(List(text), folder_ / "out");
    } catch (const InputError& e) {
      return e.what();
    }
    return "taken";
  }
  TemporaryFolder folder_;
};

TEST_F(Batch, AListsLinesAreInputsFromItsFolderNamedAsTheyAre) {
  const auto captures = ReadBatch(
      List("# captures\r\n\n first/ \r\nbad.one\n\twith space\n" + (folder_ / "in" / "film.mp4").string()), "out");
  ASSERT_EQ(captures.size(), 4U);
  EXPECT_EQ(captures[0].input, folder_ / "in" / "first");
  EXPECT_EQ(captures[0].scene, fs::path("out/first"));
  EXPECT_EQ(captures[1].name, "bad.one") << "a folder's dot is its own";
  EXPECT_EQ(captures[2].name, "with space");
  EXPECT_EQ(captures[3].name, "film");
}

TEST_F(Batch, ACapturesRunHasTheLinesOptionsButForTheBatchsOwn) {
  EXPECT_EQ(CaptureArguments({"--batch", "list.txt", "-o", "out", "--executor=slurm", "--partition", "fast", "--no-web",
                              "--sbatch-option=--time=5", "--seconds", "2", "--json", "-oother", "--quality", "low"}),
            (std::vector<std::string>{"--no-web", "--seconds", "2", "--quality", "low"}));
}

TEST_F(Batch, ListsThatCannotBeMeantAreRefusedByLine) {
  EXPECT_THAT(Refused("first\nnowhere\n"), HasSubstr("line 2: nowhere is not there"));
  EXPECT_THAT(Refused("first\n\nfirst\n"), HasSubstr("lines 1 and 3"));
  EXPECT_THAT(Refused("# nothing\n"), HasSubstr("names no input"));
  EXPECT_THAT(Refused("/\n"), HasSubstr("no name"));
  fs::create_directories(folder_ / "in" / "jobs");
  EXPECT_THAT(Refused("jobs\n"), HasSubstr("no name"));
}

TEST_F(Batch, AllAreThereAtOnceAndOneThatFailsDoesNotStopTheOthers) {
  auto executor = std::make_shared<Pretended>(3);
  const BatchOptions options{List("first\nbad.one\nwith space\n"), folder_ / "out", {"--no-video"}, executor};
  const auto code = [](const BatchOptions& o) {
    try {
      RunBatch(o, SilentProgress());
    } catch (const Error& e) {
      return e.code();
    }
    return ExitCode::kDone;
  };
  EXPECT_EQ(code(options), ExitCode::kDataRefused);
  ASSERT_EQ(executor->lines.size(), 3U);
  for (const auto& line : executor->lines) {
    EXPECT_EQ(line[1], "-o");
    EXPECT_EQ(line.back(), "--no-video");
  }
  const std::string told = ReadText(folder_ / "out" / "batch.json");
  EXPECT_THAT(told, HasSubstr("nothing to see"));
  EXPECT_THAT(told, HasSubstr("with space"));
  EXPECT_EQ(told.find("\"code\": 0"), std::string::npos);
  const auto code_of = [&](const char* list, int together) {
    return code({List(list), folder_ / "other", {}, std::make_shared<Pretended>(together)});
  };
  EXPECT_EQ(code_of("full\nfirst\n", 2), ExitCode::kMachine);
  EXPECT_EQ(code_of("full\nbad.one\n", 2), ExitCode::kDataRefused);  // they differ
  const BatchSummary well =
      RunBatch({List("first\n"), folder_ / "well", {}, std::make_shared<Pretended>(1)}, SilentProgress());
  EXPECT_EQ(well.captures[0].seconds, 2.5);
  EXPECT_THAT(Describe(well), HasSubstr("1 captures in"));
}

}  // namespace
}  // namespace lumi
