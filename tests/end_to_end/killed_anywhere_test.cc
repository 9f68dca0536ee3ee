// kill -9 at any moment, of the pipeline alone or of all that it started: the same command goes on, and the scene comes
// out as if nothing had happened.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <random>
#include <thread>

#include "scene/files/scene_folder.h"
#include "scene/geometry/similarity3.h"
#include "tests/support/bad_input.h"
#include "tests/support/fault_run.h"
#include "tests/support/same_outputs.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

constexpr unsigned kSeed = 7;
constexpr double kSameCamerasPercent = 0.05;  // COLMAP's own randomness aside, nothing differs
constexpr double kChildrenEnd_s = 300;  // they are told at once; on a loaded machine it takes them long

int Kills(int all, int few) { return FewFaults() ? few : all; }

class KilledAnywhere : public testing::Test {
 protected:
  // Runs the command again and again, each time killed after a random part of the time that a whole run takes; once it
  // is done it begins anew, until it was killed so often. Then to its end.
  template <typename Check>
  void KillAndGoOn(const std::vector<std::string>& argv, const fs::path& scene, double whole_s, int kills,
                   const Check& check) {
    std::mt19937 random(kSeed);
    int done = 0, struck = 0;
    while (struck < kills && !HasFailure()) {
      SCOPED_TRACE("kill " + std::to_string(struck));
      ChildProgram run(argv);
      const double after_s = std::uniform_real_distribution<>(0, whole_s)(random);
      std::this_thread::sleep_for(std::chrono::duration<double>(after_s));
      const bool all = random() % 2 == 0;
      run.Signal(SIGKILL);
      if (all)
        for (const pid_t pid : ProcessesNaming(scene)) ::kill(pid, SIGKILL);
      const ProgramResult result = run.Wait();
      ASSERT_TRUE(WaitForNoProcessNaming(scene, kChildrenEnd_s));
      if (result.exit_code == 0) {  // it was done before
        ++done;
        check();
        fs::remove_all(scene);
        continue;
      }
      ASSERT_EQ(result.exit_code, 128 + SIGKILL) << result.err;
      if (++struck % 10 == 0) std::cout << struck << " kills" << std::endl;
    }
    const ProgramResult last = RunProgram(argv);
    EXPECT_EQ(last.exit_code, 0) << last.err;
    check();
    std::cout << struck << " kills, " << done + 1 << " runs to the end\n";
  }
};

// COLMAP's search for matches is approximate and draws random numbers: a matching that goes on draws others. So the
// matches are given.
TEST_F(KilledAnywhere, WithCamerasAndMatchesKnownTheSceneIsTheSameToTheByte) {
  const SimulatedCapture capture("desk", 6, 160);
  const std::string poses = (capture.path() / "truth/sparse").string(), database = (capture / "database.db").string();
  const ProgramResult matched = RunProgram({"lumi-reconstruct", capture.photos().string(), "-o",
                                            (capture / "matched").string(), "--poses", poses, "--quality", "low"});
  ASSERT_EQ(matched.exit_code, 0) << matched.err;
  fs::copy(capture / "matched/colmap/database.db", database);
  const auto command = [&](const fs::path& scene) {
    std::vector<std::string> argv{"lumi-pipeline", capture.photos().string(), "-o", scene.string()};
    argv.insert(argv.end(), {"--poses", poses, "--database", database, "--proxy", "delaunay", "--holdout", "2"});
    argv.insert(argv.end(), {"--width", "64", "--seconds", "0.2", "--threads", "1", "--quiet"});
    // How sparse samples are placed follows from measured times: a frame by all its pixels.
    argv.insert(argv.end(), {"--fidelity-db", "0"});
    return argv;
  };
  // In one place: what a run records names its paths.
  const fs::path scene = capture / "scene";
  const std::string photos = Contents(capture.path());
  const ProgramResult undisturbed = RunProgram(command(scene));
  ASSERT_EQ(undisturbed.exit_code, 0) << undisturbed.err;
  const auto wanted = ComparableFiles(scene);
  fs::remove_all(scene);
  KillAndGoOn(command(scene), scene, undisturbed.seconds, Kills(100, 4), [&] {
    EXPECT_EQ(FirstDifference(wanted, ComparableFiles(scene)), "");
    EXPECT_EQ(TemporariesIn(scene), "");
  });
  EXPECT_EQ(Contents(capture.path()), photos);
}

TEST_F(KilledAnywhere, ByColmapTheCamerasAreTheSame) {
  if (FewFaults()) return;
  const SimulatedCapture capture("desk", 12, 480);
  const fs::path scene = capture / "scene";
  const std::vector<std::string> argv{"lumi-pipeline",
                                      capture.photos().string(),
                                      "-o",
                                      scene.string(),
                                      "--proxy",
                                      "plane",
                                      "--holdout",
                                      "0",
                                      "--no-video",
                                      "--quality",
                                      "low",
                                      "--threads",
                                      "1",
                                      "--quiet"};
  const ProgramResult undisturbed = RunProgram(argv);
  ASSERT_EQ(undisturbed.exit_code, 0) << undisturbed.err;
  const auto poses = [&] {
    std::map<std::string, Rigid3> found;
    for (const View& view : OpenScene(scene, {}, SilentProgress()).views) found[view.name] = view.cam_from_world;
    std::vector<Rigid3> list;
    for (const auto& [name, pose] : found) list.push_back(pose);
    return list;
  };
  const std::vector<Rigid3> wanted = poses();
  fs::remove_all(scene);
  double worst = 0;
  KillAndGoOn(argv, scene, undisturbed.seconds, 100, [&] {
    const std::vector<Rigid3> found = poses();
    ASSERT_EQ(found.size(), wanted.size());
    worst = std::max(worst, ComparePoses(found, wanted).centre_rms_percent);
    EXPECT_EQ(TemporariesIn(scene), "");
  });
  EXPECT_LE(worst, kSameCamerasPercent);
  std::cout << "centres differ by " << worst << " % at most\n";
}

}  // namespace
}  // namespace lumi
