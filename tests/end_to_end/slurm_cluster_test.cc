// The pipeline as jobs of a Slurm cluster of two nodes on this machine: the bytes of a run without one, whatever
// happens to the nodes, to the controller and to the program that submits.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <thread>

#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/subprocess.h"
#include "tests/support/bad_input.h"
#include "tests/support/fault_run.h"
#include "tests/support/same_outputs.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

void Pause(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

class SlurmCluster : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    ::setenv("SLURM_CONF", (folder_->path() / "slurm.conf").c_str(), 1);
    up_ = ::getuid() == 0 ? Cluster({"start"}) : 77;
  }
  static void TearDownTestSuite() {
    if (up_ != 77) Cluster({"stop"});
    delete folder_;
    ::unsetenv("SLURM_CONF");
  }
  void SetUp() override {
    if (up_ == 77) GTEST_SKIP() << "no slurmctld, slurmd, slurm-client and munge here, or not root";
    ASSERT_EQ(up_, 0) << "the cluster does not come up";
  }

  static int Cluster(std::vector<std::string> words) {
    words.insert(words.begin(), {LUMI_SOURCE_DIR "/tests/end_to_end/slurm_cluster.sh"});
    words.insert(words.begin() + 2, folder_->path().string());
    SubprocessOptions options;
    options.on_line = [](const std::string& line) { std::cout << line << "\n"; };
    return RunSubprocess(words, options).exit_code;
  }
  static std::string Said(const std::vector<std::string>& argv) {
    SubprocessOptions options;
    options.separate_stdout = true;
    return RunSubprocess(argv, options).out;
  }
  // The node that a job runs on; empty: none does.
  static std::string BusyNode() {
    const std::string node = Said({"squeue", "-h", "-t", "RUNNING", "-o", "%N"});
    return node.substr(0, node.find('\n'));
  }

  std::vector<std::string> Command(const fs::path& scene, bool slurm) const {
    const std::string poses = (capture_.path() / "truth/sparse").string();
    std::vector<std::string> argv{"lumi-pipeline", capture_.photos().string(), "-o", scene.string()};
    argv.insert(argv.end(), {"--poses", poses, "--database", (capture_ / "database.db").string()});
    argv.insert(argv.end(), {"--proxy", "delaunay", "--holdout", "2", "--width", "160", "--seconds", "1"});
    // How sparse samples are placed follows from measured times: a frame by all its pixels.
    argv.insert(argv.end(), {"--fidelity-db", "0", "--threads", "1"});
    if (slurm) argv.insert(argv.end(), {"--executor", "slurm"});
    return argv;
  }
  // Of the scene as a run on this machine alone leaves it; COLMAP's matching draws random numbers, and is given.
  std::map<std::string, std::string> MadeHere(const fs::path& scene) {
    const ProgramResult matched =
        RunProgram({"lumi-reconstruct", capture_.photos().string(), "-o", (capture_ / "matched").string(), "--poses",
                    (capture_.path() / "truth/sparse").string(), "--quality", "low"});
    EXPECT_EQ(matched.exit_code, 0) << matched.err;
    fs::copy(capture_ / "matched/colmap/database.db", capture_ / "database.db");
    const ProgramResult here = RunProgram(Command(scene, false));
    EXPECT_EQ(here.exit_code, 0) << here.err;
    seconds_here_ = here.seconds;
    auto files = ComparableFiles(scene);
    fs::remove_all(scene);
    return files;
  }

  static inline TemporaryFolder* folder_ = nullptr;
  static inline int up_ = 77;
  SimulatedCapture capture_{"desk", 8, 320};
  double seconds_here_ = 0;
};

TEST_F(SlurmCluster, GivesTheBytesOfARunWithoutOne) {
  const fs::path scene = capture_ / "scene";
  const auto wanted = MadeHere(scene);
  const ProgramResult there = RunProgram(Command(scene, true));
  ASSERT_EQ(there.exit_code, 0) << there.err;
  EXPECT_EQ(FirstDifference(wanted, ComparableFiles(scene)), "");
  EXPECT_FALSE(fs::exists(scene / "provenance" / "jobs")) << "the jobs' files are gone";
  EXPECT_NE(there.err.find("proxy: job "), std::string::npos);
  std::cout << "here " << seconds_here_ << " s, as jobs " << there.seconds << " s\n";
  // Again there is nothing to do: what the pictures are made of stays.
  const auto film = fs::last_write_time(scene / "fly-through.mp4");
  const ProgramResult again = RunProgram(Command(scene, true));
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(fs::last_write_time(scene / "fly-through.mp4"), film);
  EXPECT_LT(again.seconds, there.seconds);
}

TEST_F(SlurmCluster, DepthMapsAsAJobArrayGiveTheProxyOfARunWithoutOne) {
  const auto run = [&](const std::string& scene, const std::vector<std::string>& more) {
    std::vector<std::string> argv{"lumi-pipeline", capture_.photos().string(), "-o", (capture_ / scene).string()};
    argv.insert(argv.end(), {"--poses", (capture_.path() / "truth/sparse").string(), "--proxy", "dense", "--holdout",
                             "0", "--no-video", "--no-web", "--threads", "1"});
    if (scene == "there") argv.insert(argv.end(), {"--database", (capture_ / "here/colmap/database.db").string()});
    argv.insert(argv.end(), more.begin(), more.end());
    return RunProgram(argv);
  };
  ASSERT_EQ(run("here", {}).exit_code, 0);
  const ProgramResult there = run("there", {"--executor", "slurm", "--parts", "3"});
  ASSERT_EQ(there.exit_code, 0) << there.err;
  EXPECT_NE(there.err.find("job array"), std::string::npos);
  EXPECT_EQ(ReadText(capture_ / "here/proxies/dense.ply"), ReadText(capture_ / "there/proxies/dense.ply"));
  EXPECT_FALSE(fs::exists(capture_ / "there/provenance/jobs"));
}

TEST_F(SlurmCluster, ANodeIsKilledTheControllerRestartedTheSubmitterKilled) {
  const fs::path scene = capture_ / "scene";
  const auto wanted = MadeHere(scene);
  ChildProgram first(Command(scene, true));
  std::string node;
  for (int i = 0; i < 6000 && (node = BusyNode()).empty(); ++i) Pause(0.02);
  ASSERT_FALSE(node.empty());
  EXPECT_EQ(Cluster({"kill-node", node}), 0);
  Pause(1);
  EXPECT_EQ(Cluster({"restart-controller"}), 0);
  Pause(1);
  first.Signal(SIGKILL);
  first.Wait();
  const ProgramResult second = RunProgram(Command(scene, true));
  EXPECT_EQ(second.exit_code, 0) << second.err;
  EXPECT_NE(second.err.find("submitted by an earlier run"), std::string::npos) << second.err;
  EXPECT_EQ(FirstDifference(wanted, ComparableFiles(scene)), "");
  EXPECT_EQ(Cluster({"start-node", node}), 0);
}

TEST_F(SlurmCluster, SeveralCapturesAreThereAtOnce) {
  const fs::path list = capture_ / "list.txt", out = capture_ / "out";
  for (const char* name : {"one", "two", "bad"}) fs::create_directories(capture_ / name);
  for (const char* name : {"one", "two"}) fs::copy(capture_.photos(), capture_ / name, fs::copy_options::recursive);
  std::ofstream(list) << "one\ntwo\nbad\n";
  const std::string poses = (capture_.path() / "truth/sparse").string();
  const ProgramResult run =
      RunProgram({"lumi-pipeline", "--batch", list.string(), "-o", out.string(), "--executor", "slurm", "--poses",
                  poses, "--proxy", "plane", "--holdout", "0", "--no-video", "--no-web", "--threads", "1"});
  EXPECT_EQ(run.exit_code, 3) << run.err;  // an empty folder's
  EXPECT_NE(run.err.find("1 of 3 captures failed"), std::string::npos) << run.err;
  for (const char* name : {"one", "two"}) EXPECT_TRUE(fs::exists(out / name / "report.html")) << name;
}

}  // namespace
}  // namespace lumi
