// What docs/timeperiodic.md quotes of scenes that carry times, beside timeperiodic_bench: where the lamp's ball stands
// at unseen places and phases, what times cost a still scene, and real photos held out.
//
//   time_scenes_bench WORK [DATA]     WORK/lamp: a capture of lumi-simulate; DATA: with dino-rings/
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>

#include "render/effects/effects.h"
#include "render/holdout/holdout.h"
#include "render/time/clock.h"
#include "render/world/renderer.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/subprocess.h"

namespace {

namespace fs = std::filesystem;
using namespace lumi;
using nlohmann::json;

json Run(const std::string& program, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), SiblingProgram(program).string());
  arguments.insert(arguments.end(), {"--json", "--quiet"});
  SubprocessOptions options;
  options.separate_stdout = true;
  const SubprocessResult result = RunSubprocess(arguments, options);
  if (result.exit_code != 0) throw MachineError(program + " failed: " + result.out);
  return json::parse(result.out);
}

// A path of one key beside a photo's camera: a view that was not photographed.
json Key(const Scene& scene, const View& view, double aside) {
  const Eigen::Vector3d at = view.CentreInWorld() + aside * view.cam_from_world.R().row(0).transpose();
  const Camera& camera = scene.CameraOf(view);
  const Eigen::Quaterniond& q = view.cam_from_world.rotation;
  return {{"position", {at.x(), at.y(), at.z()}},
          {"cam_from_world_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"vertical_fov_deg", 2 * std::atan(0.5 * camera.height_px / camera.FocalPx().y()) * 180 / 3.141592653589793}};
}

// Where the lamp's red ball is: of what is redder than anything else that the ball sweeps over.
Eigen::Vector2d RedCentroid(const Image8& image, const Image8& moving) {
  constexpr int kRedder = 140;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weight = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double red = moving.At(x, y, 0) > 0
                             ? std::max(0, image.At(x, y, 0) - std::max(image.At(x, y, 1), image.At(x, y, 2)) - kRedder)
                             : 0;
      sum += red * Eigen::Vector2d(x + 0.5, y + 0.5);
      weight += red;
    }
  return sum / weight;
}

void BallPlaces(const std::string& example, const fs::path& capture) {
  const Scene scene = OpenScene(capture, {}, SilentProgress());
  const double frame_s = *scene.views[1].time_s - *scene.views[0].time_s;
  const int width = scene.cameras[0].width_px, height = scene.cameras[0].height_px;
  const TemporaryFolder work;
  const std::vector<double> phases{0.03, 0.21, 0.47, 0.72, 0.93};
  json truth_path{{"width", width}, {"height", height}};
  std::vector<json> keys;
  for (std::size_t i = 0; i < phases.size(); ++i)
    keys.push_back(Key(scene, scene.views[(2 * i + 1) * scene.views.size() / (2 * phases.size())], 0.013));
  for (std::size_t i = 0; i < phases.size(); ++i) {
    json key = keys[i];
    key["phase"] = phases[i];
    truth_path["keys"].push_back(key);
  }
  WriteTextAtomically(work / "truth.json", truth_path.dump());
  Run("lumi-simulate", {"--example", example, "--at", (work / "truth.json").string(), "-o", (work / "truth").string(),
                        "--width", std::to_string(width)});
  const auto farthest = [&](const std::string& window_s) {
    double off_px = 0;
    for (std::size_t i = 0; i < phases.size(); ++i) {
      json key = keys[i];
      key["time_s"] = 0;
      WriteTextAtomically(work / "path.json", json{{"format", "lumigraph-path"},
                                                   {"version", 1},
                                                   {"fps", 30},
                                                   {"width", width},
                                                   {"height", height},
                                                   {"keys", {key}}}
                                                  .dump());
      fs::remove_all(work / "out");
      Run("lumi-render", {capture.string(), "-o", (work / "out").string(), "--path", (work / "path.json").string(),
                          "--phase", fmt::format("{}", phases[i]), "--time-window-s", window_s});
      const std::string name = fmt::format("{}_{:04d}.png", example, i);
      const Image8 is = ReadImage8(work / "truth" / "images" / name),
                   moving = ReadImage8(work / "truth" / "truth" / "moving" / name);
      const Image8 out = ReadImage8(fs::directory_iterator(work / "out" / "frames")->path());
      off_px = std::max(off_px, (RedCentroid(out, moving) - RedCentroid(is, moving)).norm());
    }
    return off_px;
  };
  std::printf(
      "\n## Where the lamp's red ball stands in unseen views\n\n| window, frames | off by, at most, px |\n|---|---|\n");
  for (const double frames : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    std::printf("| %g | %.2f |\n", frames, farthest(fmt::format("{}", frames * frame_s)));
    std::fflush(stdout);
  }
}

// Something on a turntable, real photos: one of each turn held out. In the room's frame it moves; in its own nothing
// does, and a visual hull of all turns can be the proxy: what is lost by not knowing that what moves is rigid.
void Dino(const fs::path& work, const fs::path& data) {
  const fs::path room = work / "dino-room", object = work / "dino-object";
  std::vector<std::string> arguments{(data / "images").string(),
                                     "-o",
                                     room.string(),
                                     "--poses",
                                     (data / "dino_par.txt").string(),
                                     "--times",
                                     (data / "periodic" / "schedule.csv").string(),
                                     "--matching",
                                     "sequential",
                                     "--turntable"};
  Run("lumi-reconstruct", arguments);
  Run("lumi-proxy", {"plane", room.string()});
  arguments[2] = object.string();
  arguments.back() = "--database";
  arguments.push_back((room / "colmap" / "database.db").string());
  Run("lumi-reconstruct", arguments);
  for (const fs::path& scene : {room, object})
    if (!fs::exists(scene / "silhouettes"))
      Run("lumi-proxy", {"silhouettes", scene.string(), "--rule", "R + G + B > 60"});
  // The rule takes the object's dark places for background, so that half of the silhouettes disagree with the others.
  if (!fs::exists(object / "proxies" / "hull.ply")) Run("lumi-proxy", {"hull", object.string(), "--max-left-out", "1"});
  std::printf(
      "\n## A turntable: one photo of each turn held out\n\n| 139 photos in three turns | PSNR dB | over the object | "
      "SSIM | coverage |\n|---|---|---|---|---|\n");
  const auto row = [](const char* name, double psnr, double of_object, double ssim, double coverage) {
    std::printf("| %s | %.2f | %.2f | %.4f | %.1f %% |\n", name, psnr, of_object, ssim, 100 * coverage);
    std::fflush(stdout);
  };
  const json with = Run("lumi-render", {room.string(), "--holdout", "47"});
  row("with time, plane", with["psnr_mean_db"], with["psnr_object_mean_db"], with["ssim_mean"], with["coverage"]);
  row("nearest photo in place and time, plane", with["nearest_photo_psnr_mean_db"],
      with["nearest_photo_psnr_object_mean_db"], with["nearest_photo_ssim_mean"], with["nearest_photo_coverage_mean"]);
  const json without = Run("lumi-render", {room.string(), "--holdout", "47", "--time", "off"});
  row("without time, plane", without["psnr_mean_db"], without["psnr_object_mean_db"], without["ssim_mean"],
      without["coverage"]);
  row("nearest photo in place, plane", without["nearest_photo_psnr_mean_db"],
      without["nearest_photo_psnr_object_mean_db"], without["nearest_photo_ssim_mean"],
      without["nearest_photo_coverage_mean"]);
  const json rigid = Run("lumi-render", {object.string(), "--holdout", "47", "--proxy", "hull", "--time", "off"});
  row("in the object's own frame, visual hull", rigid["psnr_mean_db"], rigid["psnr_object_mean_db"], rigid["ssim_mean"],
      rigid["coverage"]);
}

// The same still scene, its photos with and without times: what --effects auto makes of it, and milliseconds a frame,
// in turn.
void StillScene(const fs::path& capture) {
  constexpr std::size_t kEvery = 20;
  constexpr int kRounds = 61, kWarmUp = 3;
  Scene plain = OpenScene(capture, {}, SilentProgress());
  Scene few = plain;
  few.views.clear();
  few.points.clear();
  for (std::size_t i = 0; i < plain.views.size(); i += kEvery) few.views.push_back(plain.views[i]);
  few.period_s.reset();
  const Mesh proxy = LoadProxy(few, "");
  const std::vector<Photo> photos = LoadPhotos(few, {}, SilentProgress());
  Scene timed = few, periodic = few;
  periodic.period_s = plain.period_s;
  for (View& v : few.views) v.time_s.reset(), v.frame_index.reset();
  const std::vector<std::pair<const char*, const Scene*>> scenes{
      {"none", &few}, {"a video's", &timed}, {"a video's, and a period", &periodic}};
  std::printf(
      "\n## What times cost a still scene\n\n| times of the photos | time counts | CPU ms | ratio | OpenGL ms | ratio "
      "|\n|---|---|---|---|---|---|\n");
  std::vector<RenderRequest> requests;
  for (const auto& [name, scene] : scenes) {
    RenderRequest r;
    r.view = HeldOutView(*scene, scene->views[scene->views.size() / 2], 0);
    r.view.centre += Eigen::Vector3d(0.01, 0.005, 0);  // beside the photo
    r.view.P.col(3) = -r.view.P.leftCols<3>() * r.view.centre;
    TakeClock(*scene, false, r.settings);
    r.settings = AtTimeOf(ChooseEffects(*scene, proxy, {r.view}, {}, r.settings, {}, {}).settings, r.view);
    requests.push_back(r);
  }
  std::array<std::vector<double>, 2> medians,
      ratios;  // to the first of the same round: whatever else the machine does meets both
  for (std::size_t backend = 0; backend < medians.size(); ++backend) {
    std::vector<std::unique_ptr<Renderer>> renderers;
    for (const auto& [name, scene] : scenes)
      renderers.push_back((backend == 0 ? MakeCpuRenderer : MakeGlRenderer)(WorldOf(*scene, proxy), photos, {}));
    std::vector<std::vector<double>> ms(scenes.size());
    for (int round = -kWarmUp; round < kRounds; ++round)
      for (std::size_t i = 0; i < scenes.size(); ++i) {
        const auto start = std::chrono::steady_clock::now();
        renderers[i]->Render(requests[i]);
        if (round >= 0)
          ms[i].push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
      }
    for (const auto& of : ms) {
      medians[backend].push_back(Median(of));
      std::vector<double> ratio;
      for (std::size_t round = 0; round < of.size(); ++round) ratio.push_back(of[round] / ms[0][round]);
      ratios[backend].push_back(Median(ratio));
    }
  }
  for (std::size_t i = 0; i < scenes.size(); ++i)
    std::printf("| %s | %s | %.2f | %.2f | %.2f | %.2f |\n", scenes[i].first, requests[i].settings.time ? "yes" : "no",
                medians[0][i], ratios[0][i], medians[1][i], ratios[1][i]);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "time_scenes_bench WORK [DATA]\n"), 2;
  const fs::path work = argv[1];
  try {
    BallPlaces("lamp", work / "lamp");
    StillScene(work / "lamp");
    if (argc > 2 && fs::exists(fs::path(argv[2]) / "dino-rings" / "periodic"))
      Dino(work, fs::path(argv[2]) / "dino-rings");
  } catch (const Error& e) {
    return std::fprintf(stderr, "time_scenes_bench: %s\n", e.what()), static_cast<int>(e.code());
  }
}
