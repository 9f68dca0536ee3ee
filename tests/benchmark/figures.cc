#include "tests/benchmark/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"
#include "scene/program/subprocess.h"
#include "tests/benchmark/truth.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

constexpr int kHoldout = 8;

struct Answer {
  int exit_code = 0;
  json summary;
};

Answer Ask(const std::string& program, std::vector<std::string> arguments, ProgressSink& progress) {
  arguments.insert(arguments.begin(), SiblingProgram(program).string());
  arguments.push_back("--json");
  SubprocessOptions options;
  options.separate_stdout = true;
  options.on_line = [&](const std::string& line) { progress.Message(line); };
  const SubprocessResult result = RunSubprocess(arguments, options);
  return {result.exit_code, json::parse(result.out, nullptr, false)};
}

json AskDone(const std::string& program, const std::vector<std::string>& arguments, ProgressSink& progress) {
  const Answer answer = Ask(program, arguments, progress);
  if (answer.exit_code != 0) throw DataError(fmt::format("{} ended with code {}", program, answer.exit_code));
  return answer.summary;
}

// RGB over black, as a hole is counted everywhere.
Image8 OverBlack(const fs::path& file) {
  const Image8 rgba = ReadImage8(file, 4);
  Image8 rgb(rgba.width, rgba.height, 3);
  for (std::size_t i = 0; i < rgba.data.size() / 4; ++i)
    for (std::size_t c = 0; c < 3; ++c)
      rgb.data[3 * i + c] = static_cast<std::uint8_t>((rgba.data[4 * i + c] * rgba.data[4 * i + 3] + 127) / 255);
  return rgb;
}

struct OwnCameraRender {
  Image8 image;
  double mean_absolute = 0;
};

// nullopt: there is no OpenGL here.
std::optional<OwnCameraRender> RenderAtOwnCamera(const fs::path& scene, const std::string& view,
                                                 const std::string& backend, bool leave_out, const fs::path& out,
                                                 ProgressSink& progress) {
  fs::remove_all(out);
  std::vector<std::string> arguments{scene.string(), "--view", view,         "--backend",
                                     backend,        "-o",     out.string(), "--quiet"};
  if (leave_out) arguments.emplace_back("--leave-out");
  const Answer answer = Ask("lumi-render", arguments, progress);
  if (answer.exit_code == static_cast<int>(ExitCode::kMachine) && backend == "gl") return std::nullopt;
  if (answer.exit_code != 0)
    throw DataError(fmt::format("lumi-render --view {} ended with code {}", view, answer.exit_code));
  OwnCameraRender render;
  render.mean_absolute = answer.summary["views"][0]["mean_absolute_difference_seen"].get<double>();
  for (const auto& entry : fs::directory_iterator(out))
    if (entry.path().extension() == ".png") render.image = OverBlack(entry.path());
  return render;
}

void MeasureReproduction(const fs::path& scene_folder, const fs::path& work, int most, CaptureFigures& f,
                         ProgressSink& progress) {
  OpenOptions open;
  open.check_photos = false;
  const Scene scene = OpenScene(scene_folder, open, SilentProgress());
  const std::size_t count = std::min<std::size_t>(static_cast<std::size_t>(most), scene.views.size());
  Progress task(progress, f.name + ": photos at their own cameras", static_cast<long>(count));
  double cpu_sum = 0, gl_sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string name = scene.views[i * scene.views.size() / count].name;
    const fs::path cpu_out = work / "own-camera-cpu", gl_out = work / "own-camera-gl";
    const auto cpu = RenderAtOwnCamera(scene_folder, name, "cpu", false, cpu_out, progress);
    cpu_sum += cpu->mean_absolute;
    f.cpu.worst_mean_absolute = std::max(f.cpu.worst_mean_absolute, cpu->mean_absolute);
    if (i == 0 || f.gl) {
      if (const auto gl = RenderAtOwnCamera(scene_folder, name, "gl", false, gl_out, progress)) {
        if (!f.gl) f.gl.emplace();
        gl_sum += gl->mean_absolute;
        f.gl->worst_mean_absolute = std::max(f.gl->worst_mean_absolute, gl->mean_absolute);
        // With its own photo a view is that photo on both; without it there is something to blend.
        const auto cpu_blend = RenderAtOwnCamera(scene_folder, name, "cpu", true, cpu_out, progress);
        const auto gl_blend = RenderAtOwnCamera(scene_folder, name, "gl", true, gl_out, progress);
        f.cpu_gl_worst_psnr_db = std::min(f.cpu_gl_worst_psnr_db.value_or(std::numeric_limits<double>::infinity()),
                                          Compare(gl_blend->image, cpu_blend->image).psnr_db);
      }
    }
    task.Step();
  }
  f.reproduced_views = static_cast<int>(count);
  f.cpu.mean_absolute = cpu_sum / static_cast<double>(count);
  if (f.gl) f.gl->mean_absolute = gl_sum / static_cast<double>(count);
}

}  // namespace

void SimulateDesk(const fs::path& folder, ProgressSink& progress) {
  AskDone("lumi-simulate", {"--example", "desk", "--views", "24", "--width", "640", "-o", folder.string()}, progress);
}

CaptureFigures MeasureCapture(const BenchCapture& capture, const fs::path& work, int views, ProgressSink& progress) {
  CaptureFigures f;
  f.name = capture.name;
  const fs::path scene = work / capture.name.substr(0, capture.name.find(' '));
  const json pipeline = AskDone(
      "lumi-pipeline",
      {capture.photos.string(), "-o", scene.string(), "--holdout", std::to_string(kHoldout), "--no-video"}, progress);
  for (const json& stage : pipeline["stages"]) {
    const json& summary = stage.contains("summary") ? stage["summary"] : json::object();
    if (stage["name"] == "reconstruct") {
      f.images_total = summary["images_total"];
      f.images_registered = summary["images_registered"];
      f.reprojection_px = summary["mean_reprojection_error_px"];
    } else if (stage["name"] == "holdout") {
      f.psnr_db = summary["psnr_mean_db"];
      f.ssim = summary["ssim_mean"];
      f.coverage = summary["coverage"];
      f.nearest_psnr_db = summary["nearest_photo_psnr_mean_db"];
      f.nearest_coverage = summary["nearest_photo_coverage_mean"];
      const auto number = [&](const char* key) {
        return summary.contains(key) ? std::optional(summary[key].get<double>()) : std::nullopt;
      };
      f.psnr_seen_db = number("psnr_seen_mean_db");
      f.seen = number("seen");
      f.nearest_psnr_seen_db = number("nearest_photo_psnr_seen_mean_db");
      f.ms_per_frame = summary["ms_per_frame"];
      f.proxy = summary["proxy"];
    }
  }
  f.colmap_s = pipeline["colmap_seconds"];
  f.around_colmap_s = pipeline["around_colmap_seconds"];
  if (!capture.truth.empty()) {
    OpenOptions open;
    open.check_photos = false;
    f.poses = CompareWithTruth(OpenScene(scene, open, SilentProgress()), ReadTruePoses(capture.truth));
  }
  MeasureReproduction(scene, work, views, f, progress);
  return f;
}

std::string ToMarkdown(const std::vector<CaptureFigures>& figures) {
  std::string text = fmt::format(
      "\n## Captures: held out\n\nPhotos 0, {0}, {1} ... rendered from the others; PSNR and SSIM over all pixels, a "
      "hole counts as "
      "black; PSNR also over the pixels that two of the others see.\n\n",
      kHoldout, 2 * kHoldout);
  text +=
      "| capture | photos | reprojection px | proxy | PSNR dB | over seen dB | seen | SSIM | coverage | nearest photo "
      "dB "
      "| over seen dB | its coverage | margin dB | ms a frame "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const CaptureFigures& f : figures)
    text += fmt::format(
        "| {} | {}/{} | {:.2f} | {} | {:.2f} | {:.2f} | {:.1f} % | {:.3f} | {:.1f} % | {:.2f} | {:.2f} | {:.1f} % | "
        "{:+.2f} | {:.0f} |\n",
        f.name, f.images_registered, f.images_total, f.reprojection_px, f.proxy, f.psnr_db,
        f.psnr_seen_db.value_or(std::nan("")), 100 * f.seen.value_or(0), f.ssim, 100 * f.coverage, f.nearest_psnr_db,
        f.nearest_psnr_seen_db.value_or(std::nan("")), 100 * f.nearest_coverage, f.psnr_db - f.nearest_psnr_db,
        f.ms_per_frame);
  text +=
      "\n## Captures: poses against the truth\n\nAfter a similarity, centres in percent of the truth's extent.\n\n"
      "| capture | centres rms % | centres max % | rotations rms deg | rotations max deg |\n|---|---|---|---|---|\n";
  for (const CaptureFigures& f : figures)
    if (f.poses)
      text += fmt::format("| {} | {:.4f} | {:.4f} | {:.4f} | {:.4f} |\n", f.name, f.poses->centre_rms_percent,
                          f.poses->centre_max_percent, f.poses->rotation_rms_deg, f.poses->rotation_max_deg);
  text +=
      "\n## Captures: photos at their own cameras\n\nMean absolute difference wherever the proxy is seen, in code "
      "values of 255 (mean "
      "over photos / worst photo).\n"
      "The same views without their own photos, CPU against GL: the worst view's PSNR.\n\n"
      "| capture | photos | CPU | GL | CPU against GL, dB |\n|---|---|---|---|---|\n";
  for (const CaptureFigures& f : figures)
    text += fmt::format(
        "| {} | {} | {:.3f} / {:.3f} | {} | {} |\n", f.name, f.reproduced_views, f.cpu.mean_absolute,
        f.cpu.worst_mean_absolute,
        f.gl ? fmt::format("{:.3f} / {:.3f}", f.gl->mean_absolute, f.gl->worst_mean_absolute) : "no OpenGL here",
        f.cpu_gl_worst_psnr_db ? fmt::format("{:.1f}", *f.cpu_gl_worst_psnr_db) : "");
  text +=
      "\n## Captures: time beside COLMAP\n\nPreparation, proxy and report.\n\n| capture | COLMAP s | around it s | "
      "share "
      "|\n|---|---|---|---|\n";
  for (const CaptureFigures& f : figures)
    text += fmt::format("| {} | {:.1f} | {:.1f} | {:.1f} % |\n", f.name, f.colmap_s, f.around_colmap_s,
                        f.colmap_s > 0 ? 100 * f.around_colmap_s / f.colmap_s : 0.0);
  return text;
}

std::string ToJson(const std::vector<CaptureFigures>& figures) {
  json captures = json::array();
  for (const CaptureFigures& f : figures) {
    json c = {{"name", f.name},
              {"images_total", f.images_total},
              {"images_registered", f.images_registered},
              {"mean_reprojection_error_px", f.reprojection_px},
              {"proxy", f.proxy},
              {"holdout", kHoldout},
              {"psnr_mean_db", f.psnr_db},
              {"ssim_mean", f.ssim},
              {"coverage", f.coverage},
              {"nearest_photo_psnr_mean_db", f.nearest_psnr_db},
              {"nearest_photo_coverage_mean", f.nearest_coverage},
              {"ms_per_frame", f.ms_per_frame},
              {"colmap_seconds", f.colmap_s},
              {"around_colmap_seconds", f.around_colmap_s},
              {"own_camera_views", f.reproduced_views},
              {"own_camera_cpu_mean_absolute", f.cpu.mean_absolute},
              {"own_camera_cpu_worst_mean_absolute", f.cpu.worst_mean_absolute}};
    if (f.gl)
      c.update({{"own_camera_gl_mean_absolute", f.gl->mean_absolute},
                {"own_camera_gl_worst_mean_absolute", f.gl->worst_mean_absolute}});
    if (f.seen) c["seen"] = *f.seen;
    if (f.psnr_seen_db) c["psnr_seen_mean_db"] = *f.psnr_seen_db;
    if (f.nearest_psnr_seen_db) c["nearest_photo_psnr_seen_mean_db"] = *f.nearest_psnr_seen_db;
    if (f.cpu_gl_worst_psnr_db) c["cpu_gl_worst_psnr_db"] = *f.cpu_gl_worst_psnr_db;
    if (f.poses)
      c["poses"] = {{"centre_rms_percent", f.poses->centre_rms_percent},
                    {"centre_max_percent", f.poses->centre_max_percent},
                    {"rotation_rms_deg", f.poses->rotation_rms_deg},
                    {"rotation_max_deg", f.poses->rotation_max_deg}};
    captures.push_back(c);
  }
  return json{{"captures", captures}}.dump();
}

}  // namespace lumi
