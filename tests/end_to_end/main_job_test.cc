// Photos in, a lumigraph out, through the real COLMAP; then again, after kills, and from a workspace.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/video.h"
#include "tests/support/bad_input.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

constexpr int kViews = 12;
// COLMAP on photos this small is good to a third of a pixel; these bounds are five times what was measured.
constexpr double kCentreRmsPercent = 1.0;
constexpr double kRotationRmsDeg = 0.5;
// The two runs' cameras differ by COLMAP's own randomness.
constexpr double kSamePsnrDb = 2.0;

std::vector<std::string> Command(const fs::path& input, const fs::path& output,
                                 const std::vector<std::string>& more = {}, int holdout = 4) {
  std::vector<std::string> argv{"lumi-pipeline", input.string()};
  if (!output.empty()) argv.insert(argv.end(), {"-o", output.string()});
  argv.insert(argv.end(), {"--holdout", std::to_string(holdout), "--width", "240", "--seconds", "1", "--json"});
  argv.insert(argv.end(), {"--proxy-minutes", "0"});  // stereo has tests of its own
  argv.insert(argv.end(), more.begin(), more.end());
  return argv;
}

json RunDone(const std::vector<std::string>& argv) {
  const ProgramResult result = RunProgram(argv);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  json summary = json::parse(result.out, nullptr, false);
  EXPECT_TRUE(summary.is_object()) << result.out;
  return summary.is_object() ? summary : json::object();
}

std::map<std::string, bool> Reused(const json& summary) {
  std::map<std::string, bool> reused;
  for (const json& stage : summary.value("stages", json::array())) reused[stage["name"]] = stage["reused"];
  return reused;
}

json StageSummary(const json& summary, const std::string& name) {
  for (const json& stage : summary.value("stages", json::array()))
    if (stage["name"] == name) return stage["summary"];
  ADD_FAILURE() << "no stage " << name;
  return json::object();
}

// What a scene consists of, but for COLMAP's working files.
std::set<std::string> Files(const fs::path& scene) {
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(scene)) {
    const std::string name = entry.path().lexically_relative(scene).generic_string();
    if (entry.is_regular_file() && !name.starts_with("colmap/")) files.insert(name);
  }
  return files;
}

class MainJob : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    capture_ = std::make_unique<SimulatedCapture>("desk", kViews, 480);
    first_ = RunDone(FromPhotos(*capture_ / "scene"));
  }
  static void TearDownTestSuite() { capture_.reset(); }
  // Small photos have few features: the fewer are sought the sooner they are matched.
  static std::vector<std::string> FromPhotos(const fs::path& scene, std::vector<std::string> more = {},
                                             int holdout = 4) {
    more.insert(more.end(), {"--quality", "low"});
    return Command(capture_->photos(), scene, more, holdout);
  }
  static fs::path ScenePath() { return *capture_ / "scene"; }
  static std::unique_ptr<SimulatedCapture> capture_;
  static json first_;  // the summary of the first run
};
std::unique_ptr<SimulatedCapture> MainJob::capture_;
json MainJob::first_;

TEST_F(MainJob, FindsTheCamerasThatTookThePhotos) {
  const Scene scene = OpenScene(ScenePath(), {}, SilentProgress());
  const auto truth_model = FindColmapModel(capture_->path() / "truth");
  ASSERT_TRUE(truth_model);
  const Scene truth = ReadColmapModel(*truth_model);
  ASSERT_EQ(scene.views.size(), static_cast<std::size_t>(kViews));
  std::vector<Rigid3> estimated, true_poses;
  for (const View& view : scene.views)
    for (const View& true_view : truth.views)
      if (true_view.name == view.name) {
        estimated.push_back(view.cam_from_world);
        true_poses.push_back(true_view.cam_from_world);
      }
  ASSERT_EQ(estimated.size(), scene.views.size());
  const PoseErrors errors = ComparePoses(estimated, true_poses);
  EXPECT_LT(errors.centre_rms_percent, kCentreRmsPercent);
  EXPECT_LT(errors.rotation_rms_deg, kRotationRmsDeg);
  RecordProperty("centre_rms_percent", std::to_string(errors.centre_rms_percent));
  RecordProperty("rotation_rms_deg", std::to_string(errors.rotation_rms_deg));
}

TEST_F(MainJob, RendersHeldOutPhotosBetterThanTheNearestPhoto) {
  const json holdout = StageSummary(first_, "holdout");
  ASSERT_EQ(holdout["views"].size(), 3U);
  EXPECT_GT(holdout["seen"].get<double>(), 0.7);
  EXPECT_GT(holdout["psnr_seen_mean_db"].get<double>(), holdout["nearest_photo_psnr_seen_mean_db"].get<double>());
  EXPECT_GT(holdout["psnr_mean_db"].get<double>(), holdout["nearest_photo_psnr_mean_db"].get<double>());
  EXPECT_GT(holdout["psnr_mean_db"].get<double>(), 18);
  EXPECT_GT(holdout["coverage"].get<double>(), 0.9);
}

TEST_F(MainJob, LeavesAReportAVideoAndAContactSheet) {
  EXPECT_EQ(first_["scene"], ScenePath().string());
  const std::string html = ReadText(first_["report"].get<std::string>());
  for (const char* part :
       {"12 of 12", "Held-out photos", "data:image/jpeg;base64", "<svg", "lumi-view", "href=\"web.html\""})
    EXPECT_THAT(html, HasSubstr(part));
  EXPECT_THAT(ReadText(first_["web"].get<std::string>()), HasSubstr("part-manifest"));
  const json report = json::parse(ReadText(ScenePath() / "report.json"));
  EXPECT_GE(report["stages"].size(), 4U);
  EXPECT_FALSE(ReadImage8(first_["contact_sheet"].get<std::string>()).empty());
  VideoReader video(first_["video"].get<std::string>());
  int frames = 0;
  while (video.Skip()) ++frames;
  EXPECT_EQ(frames, 30);
  EXPECT_EQ(video.width(), 240);
  // From sparse samples, as near to a weight at every pixel as is asked.
  const json fidelity = StageSummary(first_, "video")["fidelity"];
  EXPECT_EQ(fidelity["wanted_db"], 40);
  EXPECT_GE(fidelity["db"].get<double>(), 40);
  EXPECT_THAT(html, HasSubstr("ms a frame (a weight at every pixel: "));
}

TEST_F(MainJob, SaysWhatTookHowLong) {
  double sum = 0;
  for (const json& stage : first_["stages"]) sum += stage["seconds"].get<double>();
  EXPECT_LE(sum, first_["seconds"].get<double>() + 0.1);
  EXPECT_GT(first_["colmap_seconds"].get<double>(), 0);
  EXPECT_GT(first_["around_colmap_seconds"].get<double>(), 0);
}

TEST_F(MainJob, ASecondRunRedoesNothing) {
  const std::string before = Contents(ScenePath());
  const json second = RunDone(FromPhotos(ScenePath()));
  for (const auto& [stage, reused] : Reused(second)) EXPECT_TRUE(reused) << stage;
  EXPECT_EQ(second["stages"].size(), first_["stages"].size());
  EXPECT_EQ(Contents(ScenePath()), before);
  EXPECT_NEAR(second["colmap_seconds"].get<double>(), first_["colmap_seconds"].get<double>(), 1e-9)
      << "of the run that did the work";
}

TEST_F(MainJob, AnotherOptionRedoesOnlyWhatDependsOnIt) {
  const auto without_video = Reused(RunDone(FromPhotos(ScenePath(), {"--no-video"})));
  EXPECT_TRUE(without_video.at("reconstruct"));
  EXPECT_TRUE(without_video.at("proxy"));
  EXPECT_TRUE(without_video.at("holdout"));
  EXPECT_FALSE(without_video.at("report")) << "there is no video any more to speak of";

  const auto plane = Reused(RunDone(FromPhotos(ScenePath(), {"--no-video", "--proxy", "plane"})));
  EXPECT_TRUE(plane.at("reconstruct"));
  EXPECT_FALSE(plane.at("holdout"));
  EXPECT_EQ(OpenScene(ScenePath(), {}, SilentProgress()).active_proxy, "plane");

  std::vector<std::string> each_photo = FromPhotos(ScenePath(), {"--no-video", "--proxy", "plane"});
  *std::ranges::find(each_photo, "4") = "each";
  const json each = RunDone(each_photo);
  EXPECT_TRUE(Reused(each).at("proxy"));
  EXPECT_EQ(StageSummary(each, "holdout")["views"].size(), static_cast<std::size_t>(kViews));

  // As the other tests expect it: without the renders of photos that are not held out then.
  fs::remove_all(ScenePath() / "holdout");
  RunDone(FromPhotos(ScenePath()));
}

TEST_F(MainJob, FewerFacesAreThoseThatPhotosShowLeastOf) {
  const fs::path few = *capture_ / "few";
  fs::copy(ScenePath(), few, fs::copy_options::recursive);
  const json summary = RunDone(FromPhotos(few, {"--no-video", "--no-web", "--proxy", "delaunay", "--faces", "300"}));
  EXPECT_TRUE(Reused(summary).at("reconstruct"));
  const json simplified = StageSummary(summary, "simplify");
  EXPECT_EQ(simplified["method"], "in-pixels") << "a scene's surroundings are most of its size";
  EXPECT_EQ(simplified["from"], "delaunay");
  EXPECT_GT(simplified["faces_before"].get<int>(), 300);
  EXPECT_EQ(simplified["faces"], 300);
  EXPECT_EQ(OpenScene(few, {}, SilentProgress()).active_proxy, "delaunay-300");
}

TEST_F(MainJob, ASceneIsGoneOnWithInPlace) {
  const auto reused = Reused(RunDone(Command(ScenePath(), {})));
  EXPECT_EQ(reused.count("reconstruct"), 0U);
  EXPECT_TRUE(reused.at("proxy"));
  EXPECT_TRUE(reused.at("holdout"));
}

TEST_F(MainJob, AWorkspaceIsImportedAndLeftAsItWas) {
  const fs::path workspace = *capture_ / "workspace", imported = *capture_ / "imported";
  fs::create_directories(workspace);
  fs::copy(ScenePath() / "images", workspace / "images", fs::copy_options::recursive);
  fs::copy(ScenePath() / "sparse", workspace / "sparse", fs::copy_options::recursive);
  const std::string before = Contents(workspace);
  const json summary = RunDone(Command(workspace, imported, {"--no-video"}));
  EXPECT_EQ(Contents(workspace), before);
  EXPECT_EQ(summary["stages"][0]["name"], "import");
  EXPECT_NEAR(StageSummary(summary, "holdout")["psnr_mean_db"].get<double>(),
              StageSummary(first_, "holdout")["psnr_mean_db"].get<double>(), kSamePsnrDb);
  for (const auto& [stage, reused] : Reused(RunDone(Command(workspace, imported, {"--no-video"}))))
    EXPECT_TRUE(reused) << stage;
}

// Kills this program among those that work on the scene.
bool Strike(const fs::path& scene, const std::string& program, int signal) {
  bool struck = false;
  for (const pid_t pid : ProcessesNaming(scene)) {
    std::error_code gone;  // a process of the list may have ended since
    const fs::path exe = fs::read_symlink("/proc/" + std::to_string(pid) + "/exe", gone);
    if (!gone && exe.filename() == program) struck = ::kill(pid, signal) == 0;
  }
  return struck;
}

// One scene, interrupted and killed at every stage, each time gone on with.
TEST_F(MainJob, GoesOnAfterInterruptsAndKillsAtEveryStage) {
  const fs::path scene = *capture_ / "killed";
  const std::map<std::string, std::string> environment = {{"LUMI_PROGRESS_PIPE", "1"}};
  enum class Who { kPipeline, kStage };
  struct Blow {
    std::string at;  // in the progress
    int signal;
    Who who;
    std::string program;
  };
  const std::string photos_before = Contents(capture_->photos());
  for (const Blow& blow :
       {Blow{"reconstruct: finding features", SIGINT, Who::kPipeline, ""},
        Blow{"reconstruct: matching photos", SIGKILL, Who::kPipeline, ""},
        Blow{"reconstruct: matching photos", SIGKILL, Who::kStage, "lumi-reconstruct"},
        Blow{"reconstruct: placing cameras", SIGINT, Who::kPipeline, ""},
        Blow{"reconstruct: placing cameras", SIGKILL, Who::kPipeline, ""}, Blow{"proxy: ", SIGINT, Who::kPipeline, ""},
        Blow{"proxy: ", SIGKILL, Who::kPipeline, ""}, Blow{"proxy: ", SIGKILL, Who::kStage, "lumi-proxy"},
        Blow{"holdout: ", SIGINT, Who::kPipeline, ""}, Blow{"video: ", SIGKILL, Who::kPipeline, ""},
        Blow{"video: ", SIGINT, Who::kPipeline, ""}}) {
    SCOPED_TRACE(blow.at + " signal " + std::to_string(blow.signal) + " to " +
                 (blow.program.empty() ? "lumi-pipeline" : blow.program));
    ChildProgram run(FromPhotos(scene), environment);
    ASSERT_TRUE(run.WaitForErrorText(blow.at)) << run.Wait().err;
    if (blow.who == Who::kPipeline) {
      run.Signal(blow.signal);
    } else {
      EXPECT_TRUE(Strike(scene, blow.program, blow.signal));
    }
    const ProgramResult result = run.Wait();
    const int expected = blow.signal == SIGINT ? 130 : blow.who == Who::kPipeline ? 128 + SIGKILL : 4;
    EXPECT_EQ(result.exit_code, expected) << result.err;
    if (result.exit_code != 128 + SIGKILL) {
      EXPECT_THAT(result.ErrorLines().back(), testing::StartsWith("lumi-pipeline: ")) << "one line says how it ended";
    }
    // Nothing runs on, and nothing is half there.
    EXPECT_TRUE(WaitForNoProcessNaming(scene));
    EXPECT_FALSE(fs::exists(scene / "report.html"));
    EXPECT_FALSE(fs::exists(scene / "fly-through.mp4"));
    if (fs::exists(scene / "lumigraph.json")) {
      EXPECT_EQ(OpenScene(scene, {}, SilentProgress()).views.size(), static_cast<std::size_t>(kViews));
    }
  }
  // Where it is the page's program that is killed, all else is there, with a report, and the run says that it failed.
  ChildProgram run(FromPhotos(scene), environment);
  ASSERT_TRUE(run.WaitForErrorText("web: ")) << run.Wait().err;
  EXPECT_TRUE(Strike(scene, "lumi-export", SIGKILL));
  const ProgramResult failed = run.Wait();
  EXPECT_EQ(failed.exit_code, 4) << failed.err;
  EXPECT_THAT(failed.err, HasSubstr("web failed"));
  EXPECT_FALSE(fs::exists(scene / "web.html"));
  EXPECT_TRUE(fs::exists(scene / "report.html"));
  EXPECT_TRUE(fs::exists(scene / "fly-through.mp4"));
  EXPECT_EQ(Contents(capture_->photos()), photos_before);

  const json last = RunDone(FromPhotos(scene));
  const auto reused = Reused(last);
  EXPECT_TRUE(reused.at("reconstruct"));
  EXPECT_TRUE(reused.at("proxy"));
  EXPECT_TRUE(reused.at("holdout"));
  EXPECT_TRUE(reused.at("video"));
  EXPECT_FALSE(reused.at("web"));
  EXPECT_EQ(Files(scene), Files(ScenePath()));
  EXPECT_NEAR(StageSummary(last, "holdout")["psnr_mean_db"].get<double>(),
              StageSummary(first_, "holdout")["psnr_mean_db"].get<double>(), kSamePsnrDb);
}

TEST_F(MainJob, AReportIsWrittenWhereThePageFails) {
  const fs::path scene = *capture_ / "blocked";
  fs::copy(ScenePath(), scene, fs::copy_options::recursive);
  fs::remove(scene / "web.html");
  fs::remove(scene / "report.html");
  fs::create_directories(scene / "web.html" / "theirs");
  const ProgramResult run =
      RunProgram({"lumi-pipeline", scene.string(), "--proxy", "plane", "--holdout", "4", "--no-video", "--json"});
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_THAT(run.err, HasSubstr("web failed"));
  EXPECT_THAT(run.ErrorLines().back(), HasSubstr("web.html"));
  EXPECT_TRUE(fs::exists(scene / "report.html"));
  EXPECT_TRUE(fs::exists(scene / "web.html" / "theirs"));
}

}  // namespace
}  // namespace lumi
