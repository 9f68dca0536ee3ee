// What the whole pipeline costs, and a run that keeps to its minutes, from the cameras of a small workspace.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "tests/support/occurrences.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class PipelinePriceTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    capture_ = std::make_unique<SimulatedCapture>("desk", 10, 160);
    // As another tool's workspace: photos, cameras, points.
    fs::create_directories(Workspace());
    fs::copy(capture_->photos(), Workspace() / "images", fs::copy_options::recursive);
    fs::copy(capture_->path() / "truth" / "sparse", Workspace() / "sparse", fs::copy_options::recursive);
  }
  static void TearDownTestSuite() { capture_.reset(); }
  static fs::path Workspace() { return *capture_ / "workspace"; }
  static ProgramResult Run(const std::string& output, std::vector<std::string> more) {
    more.insert(more.begin(), {"lumi-pipeline", Workspace().string(), "-o", (*capture_ / output).string(), "--holdout",
                               "4", "--width", "64", "--seconds", "0.2", "--json"});
    return RunProgram(more);
  }
  static json Done(const ProgramResult& result) {
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return json::parse(result.out, nullptr, false);
  }
  static std::unique_ptr<SimulatedCapture> capture_;
};
std::unique_ptr<SimulatedCapture> PipelinePriceTest::capture_;

TEST_F(PipelinePriceTest, EveryQualityIsARowWithItsMinutesAndItsError) {
  const json price = Done(Run("price", {"--tradeoff", "--no-web", "--no-video"}));
  ASSERT_TRUE(price.is_object());
  std::vector<std::string> names;
  double best_db = 0;
  for (const json& row : price["qualities"]) {
    names.push_back(row["name"]);
    EXPECT_GT(row["minutes"].get<double>(), 0);
    EXPECT_GE(row["minutes"].get<double>(), row["camera_minutes"].get<double>() + row["proxy_minutes"].get<double>());
    EXPECT_GT(row["psnr_db"].get<double>(), 12);
    EXPECT_EQ(row["photos"], "10 of 10");
    EXPECT_THAT(row["dominates"].get<std::string>(), HasSubstr("%"));
    best_db = std::max(best_db, row["choosing_db"].get<double>());
  }
  // The cameras are given: only the proxy differs.
  EXPECT_THAT(names, ElementsAre("draft", "standard", "full"));
  const std::string best = price["recommended"];
  EXPECT_EQ(price["scene"], (*capture_ / "price" / best).string());
  for (const json& row : price["qualities"])
    if (row["name"] == best) {
      EXPECT_EQ(row["choosing_db"].get<double>(), best_db);
    }
  for (const char* file :
       {"tradeoff/pipeline.json", "tradeoff/pipeline.csv", "tradeoff/pipeline.svg", "full/report.html"})
    EXPECT_TRUE(fs::exists(*capture_ / "price" / file)) << file;

  // Given again nothing is computed, and the figures are those of the runs that did the work.
  const json again = Done(Run("price", {"--tradeoff", "--no-web", "--no-video"}));
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(again["qualities"][i]["psnr_db"], price["qualities"][i]["psnr_db"]);
    for (const char* minutes : {"minutes", "proxy_minutes"})
      EXPECT_NEAR(again["qualities"][i][minutes].get<double>(), price["qualities"][i][minutes].get<double>(), 1e-9);
  }
  EXPECT_EQ(again["recommended"], best);
  // For people each quality's line says once what it is.
  const ProgramResult text =
      RunProgram({"lumi-pipeline", Workspace().string(), "-o", (*capture_ / "price").string(), "--holdout", "4",
                  "--width", "64", "--seconds", "0.2", "--tradeoff", "--no-web", "--no-video"});
  EXPECT_EQ(Occurrences(text.out, "no depth maps"), 1U) << text.out;
  EXPECT_EQ(Occurrences(text.out, "recommended: " + best), 1U) << text.out;
  // Within minutes that the first takes longer than, no other is tried.
  const json short_of_time = Done(Run("price", {"--tradeoff", "--no-web", "--no-video", "--minutes", "0.0001"}));
  EXPECT_EQ(short_of_time["qualities"].size(), 1U);
  EXPECT_EQ(short_of_time["recommended"], "draft");
  EXPECT_FALSE(short_of_time["fits"].get<bool>());
}

// Cameras that an option gives are held, whatever the quality.
TEST_F(PipelinePriceTest, PhotosWithPosesDifferByTheirProxiesAlone) {
  const ProgramResult result =
      RunProgram({"lumi-pipeline", capture_->photos().string(), "-o", (*capture_ / "posed").string(), "--poses",
                  (capture_->path() / "truth" / "sparse").string(), "--tradeoff", "--no-web", "--no-video", "--holdout",
                  "4", "--json", "--minutes", "0.0001"});
  const json price = Done(result);
  ASSERT_EQ(price["qualities"].size(), 1U);
  EXPECT_EQ(price["qualities"][0]["what"], "no depth maps");
  EXPECT_EQ(price["qualities"][0]["photos"], "10 of 10");
}

TEST_F(PipelinePriceTest, MinutesAreKeptOrItIsSaid) {
  const ProgramResult enough = Run("enough", {"--minutes", "20"});
  const json kept = Done(enough)["minutes"];
  EXPECT_TRUE(kept["met"].get<bool>());
  EXPECT_LE(kept["took"].get<double>(), 20);
  EXPECT_THAT(kept["left_out"], IsEmpty());
  EXPECT_TRUE(fs::exists(*capture_ / "enough" / "fly-through.mp4"));

  const ProgramResult too_few = Run("too-few", {"--minutes", "0.001"});
  const json missed = Done(too_few)["minutes"];
  EXPECT_FALSE(missed["met"].get<bool>());
  EXPECT_THAT(missed["left_out"], ElementsAre("video", "web"));
  EXPECT_THAT(too_few.err, HasSubstr("0.001 minutes were not kept"));
  EXPECT_THAT(too_few.err, HasSubstr("video is left out"));
  EXPECT_FALSE(fs::exists(*capture_ / "too-few" / "fly-through.mp4"));
  EXPECT_TRUE(fs::exists(*capture_ / "too-few" / "report.html"));
  // The same command again takes no time, and says what its scene took.
  const json again = Done(Run("too-few", {"--minutes", "0.001"}))["minutes"];
  EXPECT_FALSE(again["met"].get<bool>());
  EXPECT_NEAR(again["took"].get<double>(), missed["took"].get<double>(), 0.2);
}

TEST_F(PipelinePriceTest, ASecondRunWithTheSameMinutesHasNothingToDo) {
  Done(Run("twice", {"--minutes", "20", "--no-video", "--no-web"}));
  const json again = Done(Run("twice", {"--minutes", "20", "--no-video", "--no-web"}));
  for (const json& stage : again["stages"]) EXPECT_TRUE(stage["reused"].get<bool>()) << stage["name"];
}

TEST_F(PipelinePriceTest, ABudgetOfAFrameChoosesTheProxy) {
  const auto chosen = [&](const char* budget_ms) {
    const json done = Done(Run("budget", {"--budget-ms", budget_ms, "--proxy-minutes", "0", "--no-video", "--no-web"}));
    for (const json& stage : done["stages"])
      if (stage["name"] == "proxy") return stage["summary"];
    return json();
  };
  const json fastest = chosen("0.000001");
  EXPECT_EQ(fastest["budget_ms"], 0.000001);
  EXPECT_THAT(fastest["reason"].get<std::string>(), HasSubstr("none is within"));
  const json any = chosen("1000000");
  EXPECT_THAT(any["reason"].get<std::string>(), HasSubstr("within 1e+06 ms a frame"));
  EXPECT_EQ(OpenScene(*capture_ / "budget", {}, SilentProgress()).active_proxy, any["name"].get<std::string>());
}

TEST_F(PipelinePriceTest, WhatDoesNotGoTogetherIsRefused) {
  for (const auto& [more, says] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--minutes", "0"}, "--minutes is above 0"},
           {{"--minutes", "nan"}, "--minutes"},
           {{"--minutes", "3", "--proxy-minutes", "1"}, "give one of --minutes and --proxy-minutes"},
           {{"--budget-ms", "0"}, "--budget-ms must be above 0"},
           {{"--budget-ms", "5", "--proxy", "plane"}, "--budget-ms goes with --proxy auto"},
           {{"--minutes", "3", "--stabilize", "smooth"}, "--minutes is for a scene"}}) {
    const ProgramResult result = Run("refused", more);
    EXPECT_EQ(result.exit_code, 2) << says;
    EXPECT_THAT(result.err, HasSubstr(says));
  }
  fs::create_directories(*capture_ / "mine");
  WriteTextAtomically(*capture_ / "mine" / "thesis.txt", "words");
  const ProgramResult result = Run("mine", {"--tradeoff"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_FALSE(fs::exists(*capture_ / "mine" / "tradeoff"));
  // Nothing is written into the input, and no scene gets scenes inside.
  for (const fs::path& out : {Workspace() / "out", fs::path(Workspace())}) {
    EXPECT_EQ(RunProgram({"lumi-pipeline", Workspace().string(), "-o", out.string(), "--tradeoff"}).exit_code, 2);
    EXPECT_FALSE(fs::exists(out / "tradeoff"));
  }
  EXPECT_EQ(
      RunProgram({"lumi-pipeline", Workspace().string(), "-o", capture_->path().string(), "--tradeoff"}).exit_code, 2);
  // A refusal of a stage leaves no folder behind.
  EXPECT_NE(RunProgram({"lumi-pipeline", Workspace().string(), "-o", (*capture_ / "nothing").string(), "--tradeoff",
                        "--proxy", "hull"})
                .exit_code,
            0);
  EXPECT_FALSE(fs::exists(*capture_ / "nothing" / "tradeoff" / "pipeline.json"));
}

}  // namespace
}  // namespace lumi
