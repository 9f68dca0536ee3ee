// lumi-proxy dense, and auto with it, as programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "tests/proxy/photographed_planes.h"
#include "tests/support/child_program.h"

namespace lumi::test {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

constexpr double kWallDepth = 5, kPlateDepth = 3;

// A wall and a plate before it, in ten photos of 128 x 96.
class DenseProgram : public testing::Test {
 protected:
  DenseProgram() {
    const std::vector<TexturedPlane> world = {{{0, 0, kWallDepth}, {6, 0, 0}, {0, 4.5, 0}, NoiseTexture(0.08, 1)},
                                              {{0.1, 0, kPlateDepth}, {0.5, 0, 0}, {0, 0.4, 0}, NoiseTexture(0.05, 2)}};
    std::vector<StereoCamera> cameras;
    for (int i = 0; i < 10; ++i) {
      const double x = 0.2 * (i - 4.5);
      cameras.push_back(CameraAt({x, 0.15 * (i % 3 - 1), 0}, {0.4 * x, 0, 4}, 128, 96));
    }
    Scene scene = SceneOf(world, cameras, path_ / "images");
    scene.folder = path_;
    WriteScene(scene, path_);
  }
  static json Done(const std::vector<std::string>& argv) {
    const ProgramResult run = RunProgram(argv);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return json::parse(run.out, nullptr, false);
  }
  std::vector<std::string> Dense(const std::vector<std::string>& more = {}) const {
    std::vector<std::string> argv{"lumi-proxy", "dense", path_.string(), "--width", "128", "--json"};
    argv.insert(argv.end(), more.begin(), more.end());
    return argv;
  }
  // Share of the mesh's vertices before the backdrop that lie on one of the two surfaces.
  double ShareOnSurfaces(const std::string& name) const {
    const Mesh mesh = ReadMesh(ProxyPath(path_, name));
    std::size_t near = 0, good = 0;
    for (const Eigen::Vector3d& x : mesh.vertices) {
      if (x.z() < 1 || x.z() > 5.2) continue;
      ++near;
      good += std::abs(x.z() - kWallDepth) < 0.05 || std::abs(x.z() - kPlateDepth) < 0.03;
    }
    return static_cast<double>(good) / static_cast<double>(near);
  }

  TemporaryFolder folder_;
  fs::path path_ = folder_ / "scene";
};

TEST_F(DenseProgram, MakesAClosedMeshOnTheSurfacesAndOneForAnEvaluation) {
  const json made = Done(Dense());
  EXPECT_EQ(made["closed"], true);
  EXPECT_EQ(made["kind"], "dense");
  EXPECT_EQ(made["depth"]["photos"], 10);
  EXPECT_GT(made["fused_points"].get<int>(), 5000);
  EXPECT_GT(ShareOnSurfaces("dense"), 0.9);
  EXPECT_EQ(OpenScene(path_, {}, SilentProgress()).active_proxy, "dense");
  // Fewer faces on request, on the same surfaces.
  ASSERT_GT(made["faces"].get<int>(), 4000);
  EXPECT_EQ(made["faces_before"], 0);
  const json few = Done(Dense({"--faces", "2000", "--name", "few"}));
  EXPECT_EQ(few["faces"], 2000);
  EXPECT_EQ(few["faces_before"], made["faces"]);
  EXPECT_EQ(few["closed"], true);
  EXPECT_GT(ShareOnSurfaces("few"), 0.9);
  const ProgramResult too_few = RunProgram(Dense({"--faces", "10"}));
  EXPECT_EQ(too_few.exit_code, 2);
  EXPECT_THAT(too_few.err, HasSubstr("--faces must be 0 or at least 1000"));
  const json again = Done(Dense());
  EXPECT_EQ(again["reused"], true);
  EXPECT_EQ(again["fused_points"], made["fused_points"]);

  // Without photos 0, 4, 8 and 2, 6: five are left.
  const json evaluation = Done(Dense({"--leave-out", "4"}));
  EXPECT_EQ(evaluation["name"], "dense-without-4");
  EXPECT_EQ(evaluation["depth"]["photos"], 5);
  EXPECT_EQ(evaluation["active"], false);
  EXPECT_TRUE(fs::exists(ProxyPath(path_, "dense-without-4")));
  EXPECT_EQ(Done({"lumi-proxy", "delaunay", path_.string(), "--leave-out", "4", "--json"})["name"], "mesh-without-4");
}

TEST_F(DenseProgram, ItsDepthMapsAreColmapsAndCanBeReadBack) {
  const json depths = Done(Dense({"--depth-only"}));
  EXPECT_EQ(depths["depth"]["photos"], 10);
  for (const char* folder : {"depth_maps", "normal_maps"})
    EXPECT_TRUE(fs::exists(path_ / "stereo" / folder / "photo14.png.geometric.bin"));
  EXPECT_THAT(ReadText(path_ / "stereo" / "fusion.cfg"), HasSubstr("photo19.png\n"));
  EXPECT_FALSE(fs::exists(path_ / "proxies"));
  const json made = Done(Dense({"--from-depth", (path_ / "stereo").string(), "--name", "theirs"}));
  EXPECT_EQ(made["depth"]["photos"], 10);
  EXPECT_GT(ShareOnSurfaces("theirs"), 0.9);
}

TEST_F(DenseProgram, GoesOnAfterAKill) {
  const fs::path planes = path_ / "stereo" / "planes";
  const auto count = [&] {
    std::error_code error;
    std::size_t maps = 0;
    for (const auto& file : fs::directory_iterator(planes, error)) maps += file.path().extension() == ".planes";
    return maps;
  };
  std::size_t kills = 0;
  for (const std::size_t maps : {3u, 8u}) {
    ChildProgram child(Dense({"--iterations", "12"}));
    while (count() < maps && fs::exists(fs::path("/proc") / std::to_string(child.pid()) / "exe")) usleep(2000);
    child.Signal(SIGKILL);
    kills += child.Wait().exit_code != 0;
  }
  EXPECT_EQ(kills, 2u);
  EXPECT_FALSE(fs::exists(ProxyPath(path_, "dense")));
  const json resumed = Done(Dense({"--iterations", "12"}));
  EXPECT_GE(resumed["depth"]["reused"].get<int>(), 8) << "maps that were finished";
  const std::string bytes = ReadText(ProxyPath(path_, "dense"));
  fs::remove_all(path_ / "stereo");
  fs::remove_all(path_ / "proxies");
  EXPECT_EQ(Done(Dense({"--iterations", "12", "--threads", "1"}))["depth"]["reused"], 0);
  EXPECT_EQ(ReadText(ProxyPath(path_, "dense")), bytes);
}

TEST_F(DenseProgram, AutoComparesItWithinItsMinutes) {
  const auto choose = [&](const std::string& minutes) {
    return Done({"lumi-proxy", "auto", path_.string(), "--choose-width", "128", "--holdout", "4", "--candidates",
                 "plane,mesh,dense,dense-strict", "--proxy-minutes", minutes, "--json"});
  };
  const auto row = [](const json& table, const std::string& name) {
    for (const json& c : table["candidates"])
      if (c["name"] == name) return c;
    return json();
  };
  const json without = choose("0");
  EXPECT_THAT(row(without, "dense")["refused"].get<std::string>(), HasSubstr("--proxy-minutes 0"));
  EXPECT_FALSE(fs::exists(path_ / "stereo"));
  const json hurried = choose("0.00001");
  EXPECT_THAT(row(hurried, "dense-strict")["refused"].get<std::string>(), HasSubstr("would take about"));
  const json chosen = choose("20");
  for (const char* name : {"plane", "mesh", "dense", "dense-strict"}) {
    EXPECT_TRUE(row(chosen, name)["psnr_mean_db"].is_number()) << chosen.dump(1);
    EXPECT_EQ(row(chosen, name)["evaluated"].get<std::string>(), std::string(name) + "-without-4");
    EXPECT_LE(row(chosen, name)["psnr_mean_db"].get<double>(),
              row(chosen, chosen["name"].get<std::string>())["psnr_mean_db"].get<double>());
  }
  EXPECT_THAT(chosen["name"].get<std::string>(), testing::StartsWith("dense")) << "a plate with sharp edges";
  EXPECT_TRUE(fs::exists(ProxyPath(path_, chosen["name"].get<std::string>())));
  EXPECT_NE(fs::exists(ProxyPath(path_, "dense")), fs::exists(ProxyPath(path_, "dense-strict")))
      << "only the chosen one";
  EXPECT_EQ(OpenScene(path_, {}, SilentProgress()).active_proxy, chosen["name"].get<std::string>());
  EXPECT_EQ(choose("20")["reused"], true);
}

TEST_F(DenseProgram, SaysWhatIsWrong) {
  for (const std::vector<std::string>& options :
       std::vector<std::vector<std::string>>{{"--width", "10"},
                                             {"--views", "0"},
                                             {"--views", "17"},
                                             {"--iterations", "0"},
                                             {"--agree", "0"},
                                             {"--merge-px", "0"},
                                             {"--memory-mb", "1"},
                                             {"--leave-out", "1"},
                                             {"--keep-choosing-fold"},
                                             {"--depth-only", "--from-depth", path_.string()}})
    EXPECT_NE(RunProgram(Dense(options)).exit_code, 0) << options.front();
  EXPECT_EQ(RunProgram(Dense({"--agree", "0"})).exit_code, 2);
  const ProgramResult absent = RunProgram(Dense({"--from-depth", (folder_ / "none").string()}));
  EXPECT_EQ(absent.exit_code, 3);
  EXPECT_THAT(absent.err, HasSubstr("depth_maps"));
  EXPECT_EQ(RunProgram(Dense({"--name", "dense-without-4"})).exit_code, 2) << "an evaluation's";
  EXPECT_EQ(RunProgram(Dense({"--leave-out", "2"})).exit_code, 1) << "no photo is left";
  fs::remove(path_ / "images" / "photo13.png");
  const ProgramResult gone = RunProgram(Dense());
  EXPECT_EQ(gone.exit_code, 3);
  EXPECT_THAT(gone.err, HasSubstr("photo13.png"));
  EXPECT_FALSE(fs::exists(path_ / "proxies"));
}

}  // namespace
}  // namespace lumi::test
