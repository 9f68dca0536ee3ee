// What docs/timeperiodic.md quotes: periods of the simulated lamp and helicopter against the truth, their pictures at
// unseen places and phases against the width of the time window, what times cost a still scene, and real photos held out.
//
//   timeperiodic_bench reconstructed EXAMPLE CAPTURE SCENE [PROXY]     what lumi-pipeline --periodic made of CAPTURE's video
//   timeperiodic_bench WORK [DATA]     WORK/lamp, WORK/helicopter: captures of lumi-simulate; DATA: with pendulum/, dino-rings/
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <nlohmann/json.hpp>

#include "render/effects/effects.h"
#include "render/holdout.h"
#include "render/renderer.h"
#include "render/view_time.h"
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

void Row(const std::string& name, const fs::path& video, bool moving, double truth) {
  std::vector<std::string> arguments{"period", video.string()};
  if (moving) arguments.emplace_back("--moving");
  const json j = Run("lumi-timeperiodic", arguments);
  const double period = j["period_frames"];
  std::printf("| %s | %d | %.2f | %.4f +- %.4f | %+.4f | %.1f |\n", name.c_str(), j["frames"].get<int>(), truth, period,
              j["period_sigma_frames"].get<double>(), 100 * (period / truth - 1), j["seconds"].get<double>());
  std::fflush(stdout);
}

struct UnseenView {
  Rigid3 cam_from_world;
  double phase = 0;
};

json Key(const UnseenView& view, const Camera& camera) {
  const Eigen::Vector3d at = view.cam_from_world.OriginInSource();
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
      const double red = moving.At(x, y, 0) > 0 ? std::max(0, image.At(x, y, 0) - std::max(image.At(x, y, 1), image.At(x, y, 2)) - kRedder) : 0;
      sum += red * Eigen::Vector2d(x + 0.5, y + 0.5);
      weight += red;
    }
  return sum / weight;
}

// What the simulation shows from places and at phases where no photo is.
class Unseen {
 public:
  Unseen(std::string example, const Scene& capture, const std::vector<UnseenView>& views) : example_(std::move(example)) {
    json path{{"width", capture.cameras[0].width_px}, {"height", capture.cameras[0].height_px}};
    for (const UnseenView& view : views) {
      json key = Key(view, capture.cameras[0]);
      key["phase"] = view.phase;
      path["keys"].push_back(key);
    }
    WriteTextAtomically(work_ / "truth.json", path.dump());
    Run("lumi-simulate", {"--example", example_, "--at", (work_ / "truth.json").string(), "-o", (work_ / "truth").string(), "--width",
                          std::to_string(capture.cameras[0].width_px)});
    for (std::size_t i = 0; i < views.size(); ++i) {
      const std::string name = fmt::format("{}_{:04d}.png", example_, i);
      is_.push_back(ReadImage8(work_ / "truth" / "images" / name));
      moving_.push_back(ReadImage8(work_ / "truth" / "truth" / "moving" / name));
    }
  }

  // Of lumi-render with these options on a scene, from `views` in the scene's own world, over the pixels where something moves at any time.
  // off_px (may be null): how far the lamp's red ball is off at most.
  double Psnr(const Scene& scene, const std::vector<UnseenView>& views, bool time, const std::vector<std::string>& options, double* off_px = nullptr) const {
    double square = 0, count = 0;
    if (off_px) *off_px = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      json key = Key(views[i], scene.cameras[0]);
      key["time_s"] = 0;
      WriteTextAtomically(work_ / "path.json", json{{"format", "lumigraph-path"}, {"version", 1}, {"fps", 30}, {"width", is_[i].width}, {"height", is_[i].height}, {"keys", {key}}}.dump());
      fs::remove_all(work_ / "out");
      std::vector<std::string> arguments{scene.folder.string(), "-o", (work_ / "out").string(), "--path", (work_ / "path.json").string()};
      arguments.insert(arguments.end(), options.begin(), options.end());
      if (!time)
        arguments.insert(arguments.end(), {"--time", "off"});
      else
        arguments.insert(arguments.end(), {"--phase", fmt::format("{}", views[i].phase)});
      Run("lumi-render", arguments);
      const Image8 out = ReadImage8(fs::directory_iterator(work_ / "out" / "frames")->path());
      if (off_px) *off_px = std::max(*off_px, (RedCentroid(out, moving_[i]) - RedCentroid(is_[i], moving_[i])).norm());
      Add(i, out, square, count);
    }
    return 10 * std::log10(255 * 255 * count / square);
  }

  // The same where view i of n is at phase i / n: one path whose frames are the views.
  double PsnrOfTurn(const Scene& scene, const std::vector<UnseenView>& views, bool time, const std::vector<std::string>& options) const {
    const double step_s = *scene.period_s / static_cast<double>(views.size());
    json path{{"format", "lumigraph-path"}, {"version", 1}, {"fps", static_cast<double>(views.size()) / (step_s * static_cast<double>(views.size() - 1))}, {"width", is_[0].width}, {"height", is_[0].height}};
    for (std::size_t i = 0; i < views.size(); ++i) {
      json key = Key(views[i], scene.cameras[0]);
      key["time_s"] = step_s * static_cast<double>(i);
      path["keys"].push_back(key);
    }
    WriteTextAtomically(work_ / "path.json", path.dump());
    fs::remove_all(work_ / "out");
    std::vector<std::string> arguments{scene.folder.string(), "-o", (work_ / "out").string(), "--path", (work_ / "path.json").string(), "--time", time ? "on" : "off"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    Run("lumi-render", arguments);
    std::vector<fs::path> frames;
    for (const auto& entry : fs::directory_iterator(work_ / "out" / "frames"))
      if (entry.path().extension() == ".png") frames.push_back(entry.path());
    std::sort(frames.begin(), frames.end());
    if (frames.size() != views.size()) throw MachineError(fmt::format("{} frames of {} views", frames.size(), views.size()));
    double square = 0, count = 0;
    for (std::size_t i = 0; i < views.size(); ++i) Add(i, ReadImage8(frames[i]), square, count);
    return 10 * std::log10(255 * 255 * count / square);
  }

 private:
  void Add(std::size_t i, const Image8& out, double& square, double& count) const {
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < out.width; ++x)
        for (int c = 0; c < 3 && moving_[i].At(x, y, 0) > 0; ++c, ++count) square += std::pow(is_[i].At(x, y, c) - out.At(x, y, c), 2);
  }

  std::string example_;
  std::vector<Image8> is_, moving_;
  TemporaryFolder work_;
};

// Over the simulation's own cameras and billboard, against the window's width: five views a step beside a photo's camera.
void Pictures(const std::string& example, const fs::path& capture) {
  const Scene scene = OpenScene(capture, {}, SilentProgress());
  const double frame_s = *scene.views[1].time_s - *scene.views[0].time_s;
  const std::vector<double> phases{0.03, 0.21, 0.47, 0.72, 0.93};
  std::vector<UnseenView> views;
  for (std::size_t i = 0; i < phases.size(); ++i) {
    Rigid3 pose = scene.views[(2 * i + 1) * scene.views.size() / (2 * phases.size())].cam_from_world;
    pose.translation.x() -= 0.013;  // the camera goes to its right
    views.push_back({pose, phases[i]});
  }
  const Unseen unseen(example, scene, views);
  std::printf("| %s, without time | | %.2f | |\n", example.c_str(), unseen.Psnr(scene, views, false, {}));
  for (const double frames : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    const double window_s = frames * frame_s;
    if (window_s > *scene.period_s) break;
    double off_px = 0;
    const double db = unseen.Psnr(scene, views, true, {"--time-window-s", fmt::format("{}", window_s)}, &off_px);
    std::printf("| %s | %g | %.2f | %s |\n", example.c_str(), frames, db, example == "lamp" ? fmt::format("{:.2f}", off_px).c_str() : "");
    std::fflush(stdout);
  }
}

// Views midway between two frames' cameras, looking as the first of them does: the same ones in the simulation's world and in a
// reconstruction's, whatever its errors are as a whole.
std::vector<UnseenView> ViewsBetween(const Scene& scene) {
  constexpr std::size_t kViews = 10;
  std::vector<const Rigid3*> of_frame(scene.views.size(), nullptr);
  for (const View& v : scene.views) of_frame.at(static_cast<std::size_t>(*v.frame_index)) = &v.cam_from_world;
  std::vector<UnseenView> views;
  const std::size_t n = of_frame.size();
  for (std::size_t i = 0; i < kViews; ++i) {
    const std::size_t first = (2 * i + 1) * n / (2 * kViews), second = (first + n / 2 + 37 * i) % n;
    if (!of_frame[first] || !of_frame[second]) throw DataError("a frame has no camera");
    Rigid3 pose = *of_frame[first];
    pose.translation = -(pose.rotation * (0.5 * (pose.OriginInSource() + of_frame[second]->OriginInSource())));
    views.push_back({pose, static_cast<double>(i) / kViews});
  }
  return views;
}

// What lumi-pipeline --periodic made of the video alone, over each of its proxies.
void Reconstructed(const std::string& example, const fs::path& capture, const fs::path& made, const std::string& only) {
  const Scene truth = OpenScene(capture, {}, SilentProgress());
  const Scene scene = OpenScene(made, {}, SilentProgress());
  std::vector<Rigid3> of_scene, of_truth;
  for (const View& v : scene.views) {
    of_scene.push_back(v.cam_from_world);
    of_truth.push_back(truth.views.at(static_cast<std::size_t>(*v.frame_index)).cam_from_world);
  }
  const PoseErrors errors = ComparePoses(of_scene, of_truth);
  std::printf("%s: period %.4f frames, %zu of %zu frames posed, centres %.2f %%, turned %.3f degrees (rms)\n\n| unseen views | without time | window of 1 frame | 2 frames |\n|---|---|---|---|\n", example.c_str(), *scene.period_s * 30, scene.views.size(),
              truth.views.size(), errors.centre_rms_percent, errors.rotation_rms_deg);
  const std::vector<UnseenView> in_truth = ViewsBetween(truth), in_scene = ViewsBetween(scene);
  const Unseen unseen(example, truth, in_truth);
  std::vector<double> times;
  for (const View& v : scene.views) times.push_back(*v.time_s);
  std::sort(times.begin(), times.end());
  const double frame_s = (times.back() - times.front()) / static_cast<double>(times.size() - 1);
  const auto row = [&](const std::string& what, const Scene& s, const std::vector<UnseenView>& views, const std::string& proxy) {
    std::printf("| %s, %s, %s%s | %.2f |", example.c_str(), what.c_str(), proxy.c_str(), proxy == s.active_proxy ? " (chosen)" : "",
                unseen.PsnrOfTurn(s, views, false, {"--proxy", proxy}));
    for (const double frames : {1.0, 2.0}) {
      std::printf(" %.2f |", unseen.PsnrOfTurn(s, views, true, {"--proxy", proxy, "--time-window-s", fmt::format("{}", frames * frame_s)}));
      std::fflush(stdout);
    }
    std::printf("\n");
  };
  if (only.empty()) row("true cameras", truth, in_truth, "billboard");
  for (const std::string& proxy : ListProxies(made))
    if (only.empty() || proxy == only) row("reconstructed", scene, in_scene, proxy);
}

// Something on a turntable, real photos: one of each turn held out. In the room's frame it moves; in its own nothing does, and a visual hull
// of all turns can be the proxy: what is lost by not knowing that what moves is rigid.
void Dino(const fs::path& work, const fs::path& data) {
  const fs::path room = work / "dino-room", object = work / "dino-object";
  std::vector<std::string> arguments{(data / "images").string(), "-o", room.string(), "--poses", (data / "dino_par.txt").string(), "--times", (data / "periodic" / "schedule.csv").string(),
                                     "--matching", "sequential", "--turntable"};
  Run("lumi-reconstruct", arguments);
  Run("lumi-proxy", {"plane", room.string()});
  arguments[2] = object.string();
  arguments.back() = "--database";
  arguments.push_back((room / "colmap" / "database.db").string());
  Run("lumi-reconstruct", arguments);
  for (const fs::path& scene : {room, object})
    if (!fs::exists(scene / "silhouettes")) Run("lumi-proxy", {"silhouettes", scene.string(), "--rule", "R + G + B > 60"});
  if (!fs::exists(object / "proxies" / "hull.ply")) Run("lumi-proxy", {"hull", object.string()});
  std::printf("\n| dino-rings/periodic, one photo of each turn held out | PSNR dB | over the object | SSIM | coverage |\n|---|---|---|---|---|\n");
  const auto row = [](const char* name, double psnr, double of_object, double ssim, double coverage) {
    std::printf("| %s | %.2f | %.2f | %.4f | %.1f %% |\n", name, psnr, of_object, ssim, 100 * coverage);
    std::fflush(stdout);
  };
  const json with = Run("lumi-render", {room.string(), "--holdout", "47"});
  row("with time, plane", with["psnr_mean_db"], with["psnr_object_mean_db"], with["ssim_mean"], with["coverage"]);
  row("nearest photo in place and time, plane", with["nearest_photo_psnr_mean_db"], with["nearest_photo_psnr_object_mean_db"], with["nearest_photo_ssim_mean"],
      with["nearest_photo_coverage_mean"]);
  const json without = Run("lumi-render", {room.string(), "--holdout", "47", "--time", "off"});
  row("without time, plane", without["psnr_mean_db"], without["psnr_object_mean_db"], without["ssim_mean"], without["coverage"]);
  row("nearest photo in place, plane", without["nearest_photo_psnr_mean_db"], without["nearest_photo_psnr_object_mean_db"], without["nearest_photo_ssim_mean"],
      without["nearest_photo_coverage_mean"]);
  const json rigid = Run("lumi-render", {object.string(), "--holdout", "47", "--proxy", "hull", "--time", "off"});
  row("in the object's own frame, visual hull", rigid["psnr_mean_db"], rigid["psnr_object_mean_db"], rigid["ssim_mean"], rigid["coverage"]);
}

// The same still scene, its photos with and without times: what --effects auto makes of it, and milliseconds a frame, in turn.
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
  const std::vector<std::pair<const char*, const Scene*>> scenes{{"none", &few}, {"a video's", &timed}, {"a video's, and a period", &periodic}};
  std::printf("\n| times of the photos | time counts | CPU ms | ratio | OpenGL ms | ratio |\n|---|---|---|---|---|---|\n");
  std::vector<RenderRequest> requests;
  for (const auto& [name, scene] : scenes) {
    RenderRequest r;
    r.view = HeldOutView(*scene, scene->views[scene->views.size() / 2], 0);
    r.view.centre += Eigen::Vector3d(0.01, 0.005, 0);  // beside the photo
    r.view.P.col(3) = -r.view.P.leftCols<3>() * r.view.centre;
    TakeClock(*scene, false, r.settings);
    r.settings = AtTimeOf(ChooseEffects(*scene, proxy, {r.view}, {}, r.settings, {}, 1).settings, r.view);
    requests.push_back(r);
  }
  std::array<std::vector<double>, 2> medians, ratios;  // to the first of the same round: whatever else the machine does meets both
  for (std::size_t backend = 0; backend < medians.size(); ++backend) {
    std::vector<std::unique_ptr<Renderer>> renderers;
    for (const auto& [name, scene] : scenes) renderers.push_back(backend == 0 ? MakeCpuRenderer(*scene, proxy, photos) : MakeGlRenderer(*scene, proxy, photos));
    std::vector<std::vector<double>> ms(scenes.size());
    for (int round = -kWarmUp; round < kRounds; ++round)
      for (std::size_t i = 0; i < scenes.size(); ++i) {
        const auto start = std::chrono::steady_clock::now();
        renderers[i]->Render(requests[i]);
        if (round >= 0) ms[i].push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
      }
    for (const auto& of : ms) {
      medians[backend].push_back(Median(of));
      std::vector<double> ratio;
      for (std::size_t round = 0; round < of.size(); ++round) ratio.push_back(of[round] / ms[0][round]);
      ratios[backend].push_back(Median(ratio));
    }
  }
  for (std::size_t i = 0; i < scenes.size(); ++i)
    std::printf("| %s | %s | %.2f | %.2f | %.2f | %.2f |\n", scenes[i].first, requests[i].settings.time ? "yes" : "no", medians[0][i], ratios[0][i], medians[1][i], ratios[1][i]);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "timeperiodic_bench WORK [DATA] | reconstructed EXAMPLE CAPTURE SCENE [PROXY]\n"), 2;
  const fs::path work = argv[1];
  try {
    if (argc > 4 && std::string(argv[1]) == "reconstructed") return Reconstructed(argv[2], argv[3], argv[4], argc > 5 ? argv[5] : ""), 0;
    std::printf("| video | frames | true period | found | error %% | seconds |\n|---|---|---|---|---|---|\n");
    for (const auto& [name, truth] : {std::pair{"lamp", 150.37}, std::pair{"helicopter", 15.37}}) {
      Row(fmt::format("{}, tripod", name), work / name / "fixed.mp4", false, truth);
      Row(fmt::format("{}, waved camera", name), work / name / "video.mp4", true, truth);
    }
    if (argc > 2 && fs::exists(fs::path(argv[2]) / "pendulum"))
      Row("pendulum (counted by eye)", fs::path(argv[2]) / "pendulum" / "clock.mpg", false, 22);
    std::printf("\n| pixels where something moves, five unseen views and phases | window, frames | PSNR dB | red ball off by, at most, px |\n|---|---|---|---|\n");
    for (const char* name : {"lamp", "helicopter"}) Pictures(name, work / name);
    StillScene(work / "lamp");
    if (argc > 2 && fs::exists(fs::path(argv[2]) / "dino-rings" / "periodic")) Dino(work, fs::path(argv[2]) / "dino-rings");
  } catch (const Error& e) {
    return std::fprintf(stderr, "timeperiodic_bench: %s\n", e.what()), static_cast<int>(e.code());
  }
}
