#include "stabilize/commands.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <map>

#include "scene/files/atomic_file.h"
#include "scene/files/file_name.h"
#include "scene/files/matrix_path.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/svg_file.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "scene/program/version.h"
#include "stabilize/track_plot.h"
#include "stabilize/view_area.h"

namespace lumi {
namespace fs = std::filesystem;

static std::map<std::string, std::string> OptionValues(const StabilizeOptions& o) {
  std::map<std::string, std::string> values{
      {"model", std::string(Name(o.model))},
      {"cutoff_hz", fmt::format("{}", o.cutoff_hz)},
      {"similar_hz", fmt::format("{}", o.similar_hz)},
      {"min_scale", fmt::format("{}", o.min_scale)},
      {"window", std::to_string(2 * o.half_window + 1)},
      {"iterations", std::to_string(o.iterations)},
      {"points", std::to_string(o.points)},
      {"border", o.crop ? "crop" : "fill"},
      {"anchors", std::to_string(o.anchors)},
  };
  if (o.fps) values["fps"] = fmt::format("{}", *o.fps);
  if (!o.object_px.empty())
    values["object"] = fmt::format("{} in frame {}", fmt::join(o.object_px, ","), o.object_frame);
  for (const Eigen::Vector2d& x : o.object_points_px) values["object_points"] += fmt::format("{},{} ", x.x(), x.y());
  return values;
}

// Records how the path was made, in the scene that the path belongs to (where that scene is one of this suite's and may
// be written to). The path itself may lie anywhere, so the record names it relative to the scene.
static void KeepRecord(const StabilizeCommandOptions& command, const StabilizeOptions& options, const Scene& scene,
                       double seconds) {
  constexpr std::size_t kLongestName = 100;
  std::error_code ec;
  if (!fs::exists(scene.folder / "lumigraph.json", ec) || ::access(scene.folder.c_str(), W_OK) != 0) return;
  const fs::path folder = fs::canonical(scene.folder);
  Provenance record;
  record.stage = "stabilize-" + command.output.stem().string().substr(0, kLongestName);
  record.version = kVersion;
  record.options = OptionValues(options);
  record.seconds = seconds;
  for (const char* part : {"sparse", "projective.json"}) record.inputs[part] = Fingerprint(folder / part);
  if (!command.before.empty()) record.inputs["continue"] = Fingerprint(command.before);
  for (const fs::path& file : {command.output, command.plot})
    if (!file.empty()) record.outputs[fs::canonical(file).lexically_relative(folder).string()] = Fingerprint(file);
  const FolderLock lock(folder);
  WriteProvenance(folder, record);
}

namespace {

// A film goes to lumi-pipeline --stabilize: what is written here is JSON, and replaces nothing but a path.
void RequirePathFile(const std::filesystem::path& output) {
  if (LowerExtension(output.string()) != ".json")
    throw UsageError(output.string() + ": the output is a .json file",
                     "-o PATH.json; lumi-pipeline VIDEO -o FILM.mp4 --stabilize MODEL makes a film");
  RequireWritable(output);
  std::error_code error;
  if (!std::filesystem::exists(output, error)) return;
  try {
    ReadMatrixPath(output);
  } catch (const Error&) {
    throw UsageError(output.string() + " is there already, and no path of this program", "name another with -o");
  }
}

}  // namespace

StabilizeSummary RunStabilize(const StabilizeCommandOptions& command, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  StabilizeOptions options = command.stabilize;
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong, "see --help");
  std::error_code ec;
  if (std::filesystem::is_directory(command.output, ec))
    throw UsageError(command.output.string() + " is a folder: -o names the path's file", "-o PATH.json");
  RequirePathFile(command.output);
  RequireSvgFile(command.plot);
  RemoveStaleTemporariesOf(command.output);
  if (!command.before.empty()) options.before = ReadMatrixPath(command.before);
  OpenOptions open;
  open.check_photos = false;  // matrices only
  const Scene scene = OpenScene(command.scene, open, progress);
  const FilmedScene film = ReadFilmedScene(scene, options.fps);
  StabilizeReport report;
  const MatrixPath path = Stabilize(film, options, report, progress);
  WriteMatrixPath(command.output, path);
  if (!command.plot.empty()) {
    std::vector<Matrix34d> P;
    for (const MatrixKey& key : path.keys)
      P.push_back(film.InUnits(path.cropped ? CroppedInPixels(key.P, film.size_px, 1 / path.view_scale) : key.P));
    WriteTextAtomically(command.plot, TrackPlot(film, P, report.focus_of_expansion_px, {}));
  }
  KeepRecord(command, options, scene, SecondsSince(start));
  const auto frame = [&](int t) { return film.frames[static_cast<std::size_t>(t)].name; };
  return {
      command.output, report, path.cropped, {frame(report.first_shown), frame(report.last_shown)}, SecondsSince(start)};
}

void ListKeys(JsonKeys& j, StabilizeSummary& s) {
  StabilizeReport& r = s.report;
  j("path", s.path).Say("model", Name(r.model));
  j("frames", r.frames, "points", r.points).Say("structure", r.homographies ? "homographies" : "points");
  j("view_scale", r.view_scale, "cropped", s.cropped).Say("kept_area", s.cropped ? r.view_scale * r.view_scale : 1.0);
  j("shake_before_px", r.shake_before_px, "shake_after_px", r.shake_after_px, "followed_frames", r.followed_frames,
    "iterations", r.iterations);
  if (r.model != MotionModel::kSmooth) j("model_rms_px", r.model_rms_px);
  if (r.focus_of_expansion_px && r.focus_of_expansion_px->allFinite())
    j("focus_of_expansion_px", *r.focus_of_expansion_px);
  if (r.model == MotionModel::kCircular) j("turn_deg", r.turn_deg);
  if (r.joined_frames > 0) j("joined_frames", r.joined_frames);
  j("shown", s.shown, "seconds", s.seconds);
}

std::string Describe(const StabilizeSummary& s) {
  const StabilizeReport& r = s.report;
  std::string text = fmt::format(
      "{} frames, {}{}: shake above 1 Hz {:.2f} -> {:.2f} px; {:.0f} % of the width is seen in every frame{}; {:.1f} s",
      r.frames, Name(r.model), r.homographies ? " by homographies (no structure)" : "", r.shake_before_px,
      r.shake_after_px, 100 * r.view_scale, s.cropped ? ", to which it is cropped" : "", s.seconds);
  if (r.followed_frames > 0)
    text += fmt::format("\n  {} frames follow the camera more closely, to keep the picture full (--min-scale)",
                        r.followed_frames);
  if (r.focus_of_expansion_px && r.focus_of_expansion_px->allFinite()) {
    const Eigen::Vector3d& e = *r.focus_of_expansion_px;
    const double length = e.head<2>().norm();
    text +=
        std::abs(e.z()) * 1e6 > length
            ? fmt::format("\n  focus of expansion at {:.0f}, {:.0f} px", e.x() / e.z(), e.y() / e.z())
            : fmt::format("\n  focus of expansion at infinity, towards {:.3f}, {:.3f}", e.x() / length, e.y() / length);
  }
  if (r.model == MotionModel::kCircular)
    text += fmt::format("\n  the camera goes {:.1f} degrees around", std::abs(r.turn_deg));
  if (r.model != MotionModel::kSmooth)
    text += fmt::format("\n  the video departs from the model by {:.1f} px rms", r.model_rms_px);
  return text + "\n  " + s.path.string();
}

}  // namespace lumi
