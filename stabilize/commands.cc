#include "stabilize/commands.h"

#include <fmt/format.h>

#include <chrono>

#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"
#include "stabilize/track_plot.h"
#include "stabilize/view_area.h"

namespace lumi {

StabilizeSummary RunStabilize(const StabilizeCommandOptions& command, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  StabilizeOptions options = command.stabilize;
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong, "see --help");
  std::error_code ec;
  if (std::filesystem::is_directory(command.output, ec))
    throw UsageError(command.output.string() + " is a folder: -o names the path's file", "-o PATH.json");
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
