// The pipeline's depth maps as tasks of a job array, on a cluster that is three shell scripts: the proxies of a run
// without one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "tests/support/fake_slurm.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class DepthMapParts : public testing::Test {
 protected:
  void SetUp() override {
    WriteFakeSlurm(capture_ / "bin");
    fs::create_directories(Workspace());
    fs::copy(capture_.photos(), Workspace() / "images", fs::copy_options::recursive);
    fs::copy(capture_.path() / "truth" / "sparse", Workspace() / "sparse", fs::copy_options::recursive);
  }
  fs::path Workspace() const { return capture_ / "workspace"; }
  ProgramResult Run(const std::string& scene, std::vector<std::string> more) const {
    more.insert(more.begin(), {"lumi-pipeline", Workspace().string(), "-o", (capture_ / scene).string(), "--holdout",
                               "4", "--no-video", "--no-web", "--json"});
    const std::string path = (capture_ / "bin").string() + ":" + std::getenv("PATH");
    return RunProgram(more, {{"PATH", path}, {"FAKE", (capture_ / "bin").string()}});
  }
  SimulatedCapture capture_{"desk", 8, 128};
};

TEST_F(DepthMapParts, GiveTheProxiesOfARunWithoutThem) {
  const std::map<std::string, std::vector<std::string>> runs = {{"usual", {"--proxy", "auto"}},
                                                                {"auto", {"--proxy", "auto", "--depth-width", "96"}},
                                                                {"dense", {"--proxy", "dense"}}};
  for (const auto& [name, here] : runs) {
    std::vector<std::string> there = here;
    there.insert(there.end(), {"--executor", "slurm", "--parts", "3", "--threads", "1"});
    const ProgramResult whole = Run(name + "-here", here);
    ASSERT_EQ(whole.exit_code, 0) << whole.err;
    const ProgramResult parts = Run(name + "-there", there);
    ASSERT_EQ(parts.exit_code, 0) << parts.err;
    std::size_t meshes = 0;
    for (const auto& entry : fs::directory_iterator(capture_ / (name + "-here") / "proxies")) {
      if (entry.path().extension() != ".ply") continue;
      ++meshes;
      EXPECT_EQ(ReadText(entry.path()), ReadText(capture_ / (name + "-there") / "proxies" / entry.path().filename()))
          << entry.path().filename();
    }
    EXPECT_GT(meshes, 0U);
    EXPECT_THAT(ReadText(capture_ / "bin" / "submitted"), HasSubstr("--array=0-2"));
    EXPECT_THAT(parts.err, HasSubstr("depth-maps-0: job array"));
    const json stages = json::parse(parts.out)["stages"];
    ASSERT_GE(stages.size(), 3U);
    EXPECT_EQ(stages[1]["name"], "depth-maps");
    EXPECT_FALSE(fs::exists(capture_ / (name + "-there") / "provenance" / "jobs"));
    // Again there is nothing to do, and no array is submitted.
    fs::remove(capture_ / "bin" / "submitted");
    const ProgramResult again = Run(name + "-there", there);
    ASSERT_EQ(again.exit_code, 0) << again.err;
    EXPECT_THAT(ReadText(capture_ / "bin" / "submitted"), Not(HasSubstr("--array")));
    EXPECT_EQ(json::parse(again.out)["stages"][1]["reused"], true);
  }
}

TEST_F(DepthMapParts, AreRefusedWhereTheyWouldSayNothing) {
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {{"--parts", "3"}, "--parts goes with --executor slurm"},
      {{"--parts", "0", "--executor", "slurm"}, "--parts is 1 to 1000"},
      {{"--parts", "3", "--executor", "slurm", "--proxy", "plane"}, "auto or dense"},
      {{"--depth-width", "128", "--proxy", "dense"}, "--depth-width goes with --proxy auto"},
      {{"--depth-width", "128", "--proxy-minutes", "2"}, "give one of --depth-width"}};
  for (const auto& [more, says] : cases) {
    const ProgramResult refused = Run("refused", more);
    EXPECT_EQ(refused.exit_code, 2) << says;
    EXPECT_THAT(refused.err, HasSubstr(says));
  }
}

}  // namespace
}  // namespace lumi
