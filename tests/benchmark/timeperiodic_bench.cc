// What docs/timeperiodic.md quotes: periods of the simulated lamp and helicopter against the truth, and their pictures at
// unseen places and phases against the width of the time window.
//
//   timeperiodic_bench WORK [DATA]     WORK/lamp, WORK/helicopter: captures of lumi-simulate; DATA: with pendulum/
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
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

// A path of one key beside a photo's camera: a view that was not photographed.
json Key(const Scene& scene, const View& view, double aside) {
  const Eigen::Vector3d at = view.CentreInWorld() + aside * view.cam_from_world.R().row(0).transpose();
  const Camera& camera = scene.CameraOf(view);
  const Eigen::Quaterniond& q = view.cam_from_world.rotation;
  return {{"position", {at.x(), at.y(), at.z()}},
          {"cam_from_world_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"vertical_fov_deg", 2 * std::atan(0.5 * camera.height_px / camera.FocalPx().y()) * 180 / 3.141592653589793}};
}

void Pictures(const std::string& example, const fs::path& capture) {
  const Scene scene = OpenScene(capture, {}, SilentProgress());
  const double period_s = *scene.period_s;
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
  Run("lumi-simulate",
      {"--example", example, "--at", (work / "truth.json").string(), "-o", (work / "truth").string(), "--width", std::to_string(width)});
  const auto psnr = [&](const std::vector<std::string>& options) {
    double square = 0, count = 0;
    for (std::size_t i = 0; i < phases.size(); ++i) {
      json key = keys[i];
      key["time_s"] = 0;
      WriteTextAtomically(
          work / "path.json",
          json{{"format", "lumigraph-path"}, {"version", 1}, {"fps", 30}, {"width", width}, {"height", height}, {"keys", {key}}}.dump());
      fs::remove_all(work / "out");
      std::vector<std::string> arguments{capture.string(), "-o", (work / "out").string(), "--path", (work / "path.json").string()};
      arguments.insert(arguments.end(), options.begin(), options.end());
      if (options.empty())
        arguments.insert(arguments.end(), {"--time", "off"});
      else
        arguments.insert(arguments.end(), {"--phase", fmt::format("{}", phases[i])});
      Run("lumi-render", arguments);
      const std::string name = fmt::format("{}_{:04d}.png", example, i);
      const Image8 is = ReadImage8(work / "truth" / "images" / name), moving = ReadImage8(work / "truth" / "truth" / "moving" / name);
      const Image8 out = ReadImage8(fs::directory_iterator(work / "out" / "frames")->path());
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          for (int c = 0; c < 3 && moving.At(x, y, 0) > 0; ++c, ++count) square += std::pow(is.At(x, y, c) - out.At(x, y, c), 2);
    }
    return 10 * std::log10(255 * 255 * count / square);
  };
  std::printf("| %s, without time | | %.2f |\n", example.c_str(), psnr({}));
  for (const double frames : {0.5, 1.0, 2.0, 4.0, 8.0}) {
    const double window_s = frames * frame_s;
    if (window_s > period_s) break;
    std::printf("| %s | %g | %.2f |\n", example.c_str(), frames, psnr({"--time-window-s", fmt::format("{}", window_s)}));
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "timeperiodic_bench WORK [DATA]\n"), 2;
  const fs::path work = argv[1];
  try {
    std::printf("| video | frames | true period | found | error %% | seconds |\n|---|---|---|---|---|---|\n");
    for (const auto& [name, truth] : {std::pair{"lamp", 150.37}, std::pair{"helicopter", 15.37}}) {
      Row(fmt::format("{}, tripod", name), work / name / "fixed.mp4", false, truth);
      Row(fmt::format("{}, waved camera", name), work / name / "video.mp4", true, truth);
    }
    if (argc > 2 && fs::exists(fs::path(argv[2]) / "pendulum"))
      Row("pendulum (counted by eye)", fs::path(argv[2]) / "pendulum" / "clock.mpg", false, 22);
    std::printf("\n| pixels where something moves, five unseen views and phases | window, frames | PSNR dB |\n|---|---|---|\n");
    for (const char* name : {"lamp", "helicopter"}) Pictures(name, work / name);
  } catch (const Error& e) {
    return std::fprintf(stderr, "timeperiodic_bench: %s\n", e.what()), static_cast<int>(e.code());
  }
}
