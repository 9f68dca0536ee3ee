#include "stabilize/commands.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/program/error.h"
#include "stabilize/track_plot.h"
#include "stabilize/view_area.h"

namespace lumi {

std::string RunStabilize(const StabilizeCommandOptions& command, ProgressSink& progress) {
  const auto start = std::chrono::steady_clock::now();
  StabilizeOptions options = command.stabilize;
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong, "see --help");
  std::error_code ec;
  if (std::filesystem::is_directory(command.output, ec)) throw UsageError(command.output.string() + " is a folder: -o names the path's file", "-o PATH.json");
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
    for (const MatrixKey& key : path.keys) P.push_back(film.InUnits(path.cropped ? CroppedInPixels(key.P, film.size_px, 1 / path.view_scale) : key.P));
    WriteTextAtomically(command.plot, TrackPlot(film, P, report.focus_of_expansion_px, {}));
  }
  nlohmann::ordered_json j;
  j["path"] = command.output.string();
  j["model"] = std::string(Name(report.model));
  j["frames"] = report.frames;
  j["points"] = report.points;
  j["structure"] = report.homographies ? "homographies" : "points";
  j["view_scale"] = report.view_scale;
  j["cropped"] = path.cropped;
  j["kept_area"] = path.cropped ? report.view_scale * report.view_scale : 1.0;
  j["shake_before_px"] = report.shake_before_px;
  j["shake_after_px"] = report.shake_after_px;
  j["followed_frames"] = report.followed_frames;
  j["iterations"] = report.iterations;
  if (report.model != MotionModel::kSmooth) j["model_rms_px"] = report.model_rms_px;
  if (report.focus_of_expansion_px && report.focus_of_expansion_px->allFinite()) {
    const Eigen::Vector3d& e = *report.focus_of_expansion_px;
    j["focus_of_expansion_px"] = {e.x(), e.y(), e.z()};
  }
  if (report.model == MotionModel::kCircular) j["turn_deg"] = report.turn_deg;
  if (report.joined_frames > 0) j["joined_frames"] = report.joined_frames;
  const auto frame = [&](int t) { return film.frames[static_cast<std::size_t>(t)].name; };
  j["shown"] = {frame(report.first_shown), frame(report.last_shown)};
  j["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return j.dump(2);
}

std::string DescribeStabilize(const std::string& json) {
  const auto j = nlohmann::json::parse(json);
  std::string text = fmt::format("{} frames, {}{}: shake above 1 Hz {:.2f} -> {:.2f} px; {:.0f} % of the width is seen in every frame{}; {:.1f} s", j["frames"].get<int>(),
                                 j["model"].get<std::string>(), j["structure"] == "homographies" ? " by homographies (no structure)" : "", j["shake_before_px"].get<double>(),
                                 j["shake_after_px"].get<double>(), 100 * j["view_scale"].get<double>(), j["cropped"].get<bool>() ? ", to which it is cropped" : "",
                                 j["seconds"].get<double>());
  if (const int n = j["followed_frames"].get<int>(); n > 0) text += fmt::format("\n  {} frames follow the camera more closely, to keep the picture full (--min-scale)", n);
  if (j.contains("focus_of_expansion_px")) {
    const auto& e = j["focus_of_expansion_px"];
    const double x = e[0], y = e[1], w = e[2];
    text += std::abs(w) * 1e6 > std::hypot(x, y) ? fmt::format("\n  focus of expansion at {:.0f}, {:.0f} px", x / w, y / w)
                                                 : fmt::format("\n  focus of expansion at infinity, towards {:.3f}, {:.3f}", x / std::hypot(x, y), y / std::hypot(x, y));
  }
  if (j.contains("turn_deg")) text += fmt::format("\n  the camera goes {:.1f} degrees around", std::abs(j["turn_deg"].get<double>()));
  if (j.contains("model_rms_px")) text += fmt::format("\n  the video departs from the model by {:.1f} px rms", j["model_rms_px"].get<double>());
  return text + "\n  " + j["path"].get<std::string>();
}

}  // namespace lumi
