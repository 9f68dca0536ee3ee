// lumi-proxy dense, and auto with it, as programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/mesh_io.h"
#include "scene/files/provenance.h"
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
  DenseProgram() { WritePhotographed(path_, 10, 128); }
  static void WritePhotographed(const fs::path& folder, int photos, int width_px) {
    const std::vector<TexturedPlane> world = {{{0, 0, kWallDepth}, {6, 0, 0}, {0, 4.5, 0}, NoiseTexture(0.08, 1)},
                                              {{0.1, 0, kPlateDepth}, {0.5, 0, 0}, {0, 0.4, 0}, NoiseTexture(0.05, 2)}};
    std::vector<StereoCamera> cameras;
    for (int i = 0; i < photos; ++i) {
      const double x = 0.2 * (i - 0.5 * (photos - 1));
      cameras.push_back(CameraAt({x, 0.15 * (i % 3 - 1), 0}, {0.4 * x, 0, 4}, width_px, width_px * 3 / 4));
    }
    Scene scene = SceneOf(world, cameras, folder / "images");
    scene.folder = folder;
    WriteScene(scene, folder);
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
  EXPECT_EQ(few["reached"], true);
  EXPECT_TRUE(few["removed_parts"].is_number());
  EXPECT_EQ(few["faces_before"], made["faces"]);
  EXPECT_EQ(few["closed"], true);
  EXPECT_GT(ShareOnSurfaces("few"), 0.75);  // flat surfaces keep few vertices, the edges between them keep theirs
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
  EXPECT_EQ(Done({"lumi-proxy", "delaunay", path_.string(), "--leave-out", "4", "--json"})["name"],
            "delaunay-without-4");
}

TEST_F(DenseProgram, MakesAProxyForEachFoldOfPhotosThatIsLeftOut) {
  const ProgramResult run =
      RunProgram({"lumi-proxy", "dense", path_.string(), "--width", "64", "--leave-out", "each", "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("about 5 times as long"));
  EXPECT_THAT(run.err, HasSubstr("dense-without-each-3-of-5 (4 of 5)"));
  const json made = json::parse(run.out);
  ASSERT_EQ(made["proxies"].size(), 5u);
  for (std::size_t k = 0; k < 5; ++k) {
    const std::string name = "dense-without-each-" + std::to_string(k) + "-of-5";
    EXPECT_EQ(made["proxies"][k]["name"], name);
    EXPECT_EQ(made["proxies"][k]["active"], false);
    EXPECT_TRUE(fs::exists(ProxyPath(path_, name)));
    // Two of ten photos have no depth map there.
    EXPECT_EQ(json::parse(ReadText(ProxyPath(path_, name).replace_extension(".json")))["depth"]["photos"], 8) << name;
  }
  EXPECT_TRUE(ListProxies(path_).empty()) << "they are for an evaluation";
  // What reads them: every photo is rendered over a mesh that did not know it.
  Done({"lumi-proxy", "plane", path_.string(), "--json"});
  Done({"lumi-proxy", "plane", path_.string(), "--leave-out", "each", "--json"});
  const json errors = Done({"lumi-render", path_.string(), "--proxy", "plane", "--holdout", "each", "--json"});
  EXPECT_EQ(errors["proxy_evaluated"], "plane-without-each-K-of-5");
  EXPECT_EQ(errors["views"].size(), 10u);
  const json again = Done({"lumi-proxy", "plane", path_.string(), "--leave-out", "each", "--json"});
  for (const json& proxy : again["proxies"]) EXPECT_EQ(proxy["reused"], true);
}

TEST_F(DenseProgram, OfFewPhotosEachHasAProxyOfItsOwn) {
  const std::string few = (folder_ / "few").string();
  WritePhotographed(few, 4, 96);
  EXPECT_EQ(Done({"lumi-proxy", "plane", few, "--leave-out", "each", "--json"})["proxies"].size(), 4u);
  Done({"lumi-proxy", "plane", few, "--json"});
  EXPECT_EQ(Done({"lumi-render", few, "--holdout", "each", "--json"})["proxy_evaluated"], "plane-without-each-K-of-5");
}

TEST_F(DenseProgram, MeasuresWhatItsSettingsCostAndNoWidthTwice) {
  const fs::path scene = folder_ / "measured";
  WritePhotographed(scene, 10, 256);
  const ProgramResult run = RunProgram({"lumi-proxy", "dense", scene.string(), "--width", "64", "--iterations", "2",
                                        "--tradeoff", "--holdout", "5", "--choose-width", "64"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  for (const char* text : {"held-out dB", "as given", "agree 4", "merge-px 4", "views 10", "iterations 8"})
    EXPECT_THAT(run.out, HasSubstr(text));
  const json table = json::parse(ReadText(scene / "tradeoff" / "dense.json"));
  std::vector<int> widths;
  for (const json& row : table["points"]) {
    EXPECT_TRUE(row["psnr_holdout_db"].is_number()) << row.dump();
    EXPECT_GT(row["seconds"].get<double>(), 0) << row.dump();
    if (row["line"] == "width") widths.push_back(row["width"]);
  }
  EXPECT_THAT(widths, testing::ElementsAre(240)) << "maps of 320 pixels and more are no larger than the photos";
  EXPECT_EQ(table["points"].size(), 14u);
  EXPECT_THAT(ReadText(scene / "tradeoff" / "dense.csv"), HasSubstr("width 240"));
  EXPECT_THAT(ReadText(scene / "tradeoff" / "dense.svg"), HasSubstr("</svg>"));
  EXPECT_FALSE(fs::exists(scene / "proxies")) << "nothing is left but the table";
}

TEST_F(DenseProgram, ItsDepthMapsAreColmapsAndCanBeReadBack) {
  const json depths = Done(Dense({"--depth-only"}));
  EXPECT_EQ(depths["depth"]["photos"], 10);
  for (const char* folder : {"depth_maps", "normal_maps"})
    EXPECT_TRUE(fs::exists(path_ / "stereo" / folder / "photo14.png.geometric.bin"));
  EXPECT_THAT(ReadText(path_ / "stereo" / "fusion.cfg"), HasSubstr("photo19.png\n"));
  EXPECT_FALSE(fs::exists(path_ / "proxies"));
  const auto record = ReadProvenance(path_, "depth-maps");
  ASSERT_TRUE(record);
  for (const auto& [file, hash] : record->outputs) EXPECT_EQ(hash, Fingerprint(path_ / file)) << file;
  EXPECT_TRUE(record->outputs.contains("stereo/depth_maps"));
  json again = Done(Dense({"--depth-only"}));
  EXPECT_EQ(again["reused"], true);
  EXPECT_EQ(again["depth"], depths["depth"]);
  const json made = Done(Dense({"--from-depth", (path_ / "stereo").string(), "--name", "theirs"}));
  EXPECT_EQ(made["depth"]["photos"], 10);
  EXPECT_GT(ShareOnSurfaces("theirs"), 0.9);
}

TEST_F(DenseProgram, GoesOnAfterAKill) {
  const fs::path planes = path_ / "stereo" / "planes";
  const auto count = [&] {
    std::error_code error;
    std::size_t maps = 0;
    for (const auto& file : fs::directory_iterator(planes, error))  // one that is being written is hidden
      maps += file.path().extension() == ".planes" && !file.path().filename().string().starts_with(".");
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

TEST_F(DenseProgram, PartsOfItsMapsMakeTheSameMesh) {
  const auto part = [&](const std::string& shard, std::vector<std::string> more = {}) {
    more.insert(more.end(), {"--shard", shard});
    return Done(Dense(more));
  };
  const json first = part("0/2");
  EXPECT_EQ(first["part"], "0/2");
  EXPECT_EQ(first["photos"], 5);
  EXPECT_EQ(first["finished"], false);
  EXPECT_EQ(first["waits_for"], json({1}));
  EXPECT_FALSE(fs::exists(ProxyPath(path_, "dense")));
  bool finished = false;
  for (int runs = 0; runs < 4 && !finished; ++runs) {
    finished = part("1/2")["finished"];
    finished = part("0/2")["finished"].get<bool>() && finished;
  }
  EXPECT_TRUE(finished);
  EXPECT_TRUE(fs::exists(path_ / "provenance" / "depth-maps-part-0-of-2.json"));
  // Maps of other options are refused, by a part and by the whole, and nothing is lost.
  for (const std::vector<std::string>& other :
       {std::vector<std::string>{"--seed", "3"}, {"--seed", "3", "--shard", "0/2"}}) {
    const ProgramResult refused = RunProgram(Dense(other));
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_THAT(refused.err, HasSubstr("there seed 0, here seed 3"));
  }
  EXPECT_EQ(Done(Dense())["depth"]["reused"], 40) << "four rounds of ten photos";
  const std::string bytes = ReadText(ProxyPath(path_, "dense"));
  fs::remove_all(path_ / "stereo");
  fs::remove_all(path_ / "proxies");
  EXPECT_EQ(Done(Dense())["depth"]["reused"], 0);
  EXPECT_EQ(ReadText(ProxyPath(path_, "dense")), bytes);
  const fs::path other_maps = folder_ / "other";
  fs::create_directories(other_maps / "depth_maps");
  for (const std::vector<std::string>& more :
       std::vector<std::vector<std::string>>{{"--tradeoff"},
                                             {"--leave-out", "each"},
                                             {"-o", (folder_ / "x.ply").string()},
                                             {"--from-depth", other_maps.string()}}) {
    std::vector<std::string> wrong = more;
    wrong.insert(wrong.end(), {"--shard", "0/2"});
    const ProgramResult refused = RunProgram(Dense(wrong));
    EXPECT_EQ(refused.exit_code, 2) << more.front();
    EXPECT_THAT(refused.err, HasSubstr("--shard")) << more.front();
  }
}

TEST_F(DenseProgram, AutoTakesPartsOfTheMaps) {
  const auto command = [&](std::vector<std::string> more) {
    std::vector<std::string> all{"lumi-proxy", "auto", path_.string(), "--choose-width", "128",
                                 "--holdout",  "4",    "--candidates", "plane,dense",    "--json"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  EXPECT_THAT(RunProgram(command({"--shard", "0/2", "--proxy-minutes", "3"})).err,
              HasSubstr("not with --proxy-minutes"));
  EXPECT_THAT(RunProgram(command({"--depth-width", "96", "--proxy-minutes", "3"})).err, HasSubstr("give one of"));
  EXPECT_THAT(RunProgram(command({"--depth-width", "9"})).err, HasSubstr("--depth-width must be 64 to 8192"));
  bool finished = false;
  for (int runs = 0; runs < 4 && !finished; ++runs) {
    finished = true;
    for (const char* shard : {"0/2", "1/2"})
      finished &= Done(command({"--depth-width", "96", "--shard", shard}))["finished"].get<bool>();
  }
  EXPECT_THAT(RunProgram(command({"--depth-width", "64"})).err, HasSubstr("there width 96, here width 64"));
  EXPECT_THAT(RunProgram(command({"--shard", "0/2"})).err, HasSubstr("there width 96, here width 640"));
  const json chosen = Done(command({"--depth-width", "96"}));
  EXPECT_EQ(chosen["name"], "dense");
  const std::string figures = ReadText(ProxyPath(path_, "dense-without-4").replace_extension(".json"));
  EXPECT_EQ(json::parse(figures)["depth"]["reused"], 20) << "four rounds of five photos";
  EXPECT_EQ(Done(command({"--depth-width", "96", "--shard", "1/2"}))["folder"], "") << "it is made";
}

TEST_F(DenseProgram, AutoComparesItWithinItsMinutes) {
  const auto choose = [&](const std::string& minutes) {
    return Done({"lumi-proxy", "auto", path_.string(), "--choose-width", "128", "--holdout", "4", "--candidates",
                 "plane,delaunay,dense,dense-strict", "--proxy-minutes", minutes, "--json"});
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
  for (const char* name : {"plane", "delaunay", "dense", "dense-strict"}) {
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

// How long the cameras took is recorded nowhere, and it does not matter.
TEST_F(DenseProgram, AutoMakesItUnasked) {
  const std::vector<std::string> choose{"lumi-proxy", "auto", path_.string(), "--choose-width", "128",
                                        "--holdout",  "4",    "--candidates", "plane,dense",    "--json"};
  const json chosen = Done(choose);
  EXPECT_EQ(chosen["name"], "dense");
  EXPECT_EQ(json::parse(ReadText(path_ / "provenance/proxy-dense.json"))["options"]["width"], "640");

  // Of a scene that repeats itself few photos show one moment.
  Scene scene = OpenScene(path_, {}, SilentProgress());
  scene.period_s = 1;
  double time_s = 0;
  for (View& view : scene.views) view.time_s = time_s += 0.1;
  const fs::path repeats = folder_ / "repeats";
  fs::create_directories(repeats);
  fs::copy(path_ / "images", repeats / "images", fs::copy_options::recursive);
  scene.folder = repeats;
  scene.image_folder = repeats / "images";
  WriteScene(scene, repeats);
  std::vector<std::string> again = choose;
  again[2] = repeats.string();
  const json refused = Done(again)["candidates"][1];
  EXPECT_EQ(refused["name"], "dense");
  EXPECT_THAT(refused["refused"].get<std::string>(), HasSubstr("--proxy-minutes or --depth-width asks for"));
  again.insert(again.end(), {"--shard", "0/2"});
  const ProgramResult part = RunProgram(again);
  EXPECT_EQ(json::parse(part.out)["folder"], "");
  EXPECT_THAT(part.err, HasSubstr("no depth maps: the scene repeats itself"));
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
                                             {"--leave-out", "all"},
                                             {"--leave-out", "each", "--keep-choosing-fold"},
                                             {"--leave-out", "each", "--output", (folder_ / "x.ply").string()},
                                             {"--leave-out", "each", "--activate"},
                                             {"--leave-out", "each", "--depth-only"},
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
