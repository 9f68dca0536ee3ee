#include "calibrate/calibrate.h"

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "calibrate/report.h"
#include "scene/files/atomic_file.h"
#include "scene/files/camera_yaml.h"
#include "scene/files/image_io.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "scene/tradeoff/json_rows.h"
#include "scene/undistort/undistorter.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

using nlohmann::ordered_json;

constexpr int kMostCorners = 200;  // along a side of a board

// Where files will go, before anything is computed.
void RequireWritable(const CalibrateOptions& options, const CalibrateSummary& summary) {
  if (options.output.empty() || options.output.filename().empty() || fs::is_directory(options.output))
    throw UsageError(fmt::format("{} is no name of a file", options.output.string()), "-o camera.yaml");
  if (const std::string ending = options.output.extension().string(); ending != ".yaml" && ending != ".yml")
    throw UsageError(fmt::format("{}: the output is a .yaml file", options.output.string()), "-o camera.yaml");
  if (fs::exists(summary.report) && (fs::is_directory(summary.report) || ReadText(summary.report).find(kReportMark) == std::string::npos))
    throw UsageError(fmt::format("{} is there already and not a report of this program", summary.report.string()), "name another with --report");
  if (!options.undistort.empty()) {
    RequireOurFolder(options.undistort, "camera.yaml");
    if (fs::exists(options.input) && fs::exists(options.undistort) && fs::equivalent(options.input, options.undistort))
      throw UsageError("the undistorted photos would replace the photos", "name another folder with --undistort");
  }
}

// Photos that show the calibrated camera's picture: all of its size, with or without a board; of a video the frames used.
int WriteUndistorted(const CalibrateOptions& options, const CalibrateSummary& summary, ProgressSink& progress) {
  const int width = summary.gathered.width_px, height = summary.gathered.height_px;
  const PlumbBobCamera camera = PlumbBobOf(summary.fit.calibration.intrinsics, width, height);
  const Camera pinhole = PinholeInside(camera);
  const Undistorter undistort(camera, pinhole);
  fs::create_directories(options.undistort);
  int written = 0;
  const auto write = [&](const std::string& stem, const Image8& photo) {
    if (photo.width != width || photo.height != height) return;
    WriteImage(options.undistort / (stem + ".png"), undistort(photo));
    ++written;
  };
  if (summary.gathered.video) {
    std::map<std::string, bool> used;
    for (const BoardView& view : summary.fit.views) used[view.name] = true;
    Progress task(progress, "undistorted", static_cast<long>(used.size()));
    VideoReader reader(options.input);
    while (auto frame = reader.Next())
      if (used.contains(fmt::format("frame {:06d}", frame->index))) write(fmt::format("frame_{:06d}", frame->index), frame->rgb), task.Step();
  } else {
    const auto photos = PhotosOf(options.input);
    Progress task(progress, "undistorted", static_cast<long>(photos.size()));
    std::map<std::string, int> stems;
    for (const fs::path& photo : photos) ++stems[photo.stem().string()];
    for (const fs::path& photo : photos) {
      task.Step();
      try {
        write(stems[photo.stem().string()] > 1 ? photo.filename().string() : photo.stem().string(), ReadImage8(photo));
      } catch (const InputError&) {
        // Told among the refused already.
      }
    }
  }
  WriteCameraYaml(pinhole, options.undistort / "camera.yaml");
  return written;
}

}  // namespace

Board ParseBoard(const std::string& text, double square_mm) {
  Board board;
  const std::size_t x = text.find_first_of("xX");
  const auto number = [](const std::string& s, int& value) {
    const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
    return error == std::errc() && end == s.data() + s.size();
  };
  if (x == std::string::npos || !number(text.substr(0, x), board.columns) || !number(text.substr(x + 1), board.rows))
    throw UsageError(fmt::format("--board \"{}\" is no size", text), "inner corners, columns x rows: 9x6");
  if (std::min(board.columns, board.rows) < 3 || std::max(board.columns, board.rows) > kMostCorners)
    throw UsageError(fmt::format("--board {}: a board has 3 to {} inner corners along a side", text, kMostCorners), "--board counts where four squares meet");
  if (!(square_mm > 0) || !std::isfinite(square_mm)) throw UsageError("--square-mm has to be above 0");
  board.square_mm = square_mm;
  return board;
}

std::optional<ColmapCamera> ColmapCameraOf(const Intrinsics& k) {
  if (k[kSkew] != 0) return std::nullopt;
  const std::string pinhole = fmt::format("{:.10g},{:.10g},{:.10g},{:.10g}", k[kFx], k[kFx] * k[kAspect], k[kCx], k[kCy]);
  if (k[kK3] != 0)
    return ColmapCamera{"FULL_OPENCV", pinhole + fmt::format(",{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},0,0,0", k[kK1], k[kK2], k[kP1], k[kP2], k[kK3])};
  if (k.segment<kK3 - kK1>(kK1).isZero(0)) return ColmapCamera{"PINHOLE", pinhole};
  return ColmapCamera{"OPENCV", pinhole + fmt::format(",{:.10g},{:.10g},{:.10g},{:.10g}", k[kK1], k[kK2], k[kP1], k[kP2])};
}

CalibrateSummary Calibrate(const CalibrateOptions& options, ProgressSink& progress) {
  const auto begin = std::chrono::steady_clock::now();
  const Board board = ParseBoard(options.board, options.square_mm);
  if (const std::string problem = options.fit.Problem(); !problem.empty()) throw UsageError(problem);
  CalibrateSummary summary;
  summary.output = options.output;
  summary.report = options.report.empty() ? options.output.parent_path() / "report.html" : options.report;
  RequireWritable(options, summary);

  summary.gathered = GatherBoards(options.input, board, options.gather, progress);
  const int width = summary.gathered.width_px, height = summary.gathered.height_px;
  summary.fit = Fit(board, summary.gathered.views, width, height, options.fit);
  summary.uncertainty = ProjectionUncertainty(summary.fit.calibration, width, height);
  if (options.tradeoff) summary.tradeoff = ViewCountTradeoff(board, summary.fit, options.seed);
  if (!options.undistort.empty()) summary.undistorted = WriteUndistorted(options, summary, progress);
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (options.tradeoff) {
    const TradeoffTable table = ViewCountTable(summary.tradeoff);
    ordered_json json = ordered_json::parse(JsonTextOf(table));
    json.update(ordered_json::parse(JsonTextOf(ModelTable(summary.fit))));
    summary.tradeoff_files = WriteTradeoff(fs::path(options.output).replace_extension(".tradeoff"), table, ViewCountPlots(table), json.dump(2) + "\n");
  }
  WriteTextAtomically(summary.report, ReportHtml(options, summary));
  WriteCameraYaml(PlumbBobOf(summary.fit.calibration.intrinsics, width, height), options.output);
  return summary;
}

std::string ToJson(const CalibrateOptions& options, const CalibrateSummary& summary) {
  const Calibration& c = summary.fit.calibration;
  const Intrinsics& k = c.intrinsics;
  ordered_json j;
  j["fx"] = k[kFx], j["fy"] = c.Fy(), j["cx"] = k[kCx], j["cy"] = k[kCy], j["skew"] = k[kSkew];
  j["k1"] = k[kK1], j["k2"] = k[kK2], j["p1"] = k[kP1], j["p2"] = k[kP2], j["k3"] = k[kK3];
  j["sigma_fx"] = c.Sigma(kFx, c.noise_px), j["sigma_fy"] = c.SigmaFy(c.noise_px);
  const std::vector<std::pair<const char*, Term>> others = {{"cx", kCx}, {"cy", kCy}, {"skew", kSkew}, {"k1", kK1},
                                                            {"k2", kK2}, {"p1", kP1}, {"p2", kP2},     {"k3", kK3}};
  for (const auto& [name, term] : others) j[std::string("sigma_") + name] = c.Sigma(term, c.noise_px);
  j["rms_px"] = c.rms_px;
  j["cross_validated_rms_px"] = summary.fit.cross_validated_rms_px ? ordered_json(*summary.fit.cross_validated_rms_px) : ordered_json();
  j["noise_px"] = c.noise_px;
  j["width_px"] = summary.gathered.width_px, j["height_px"] = summary.gathered.height_px;
  j["board"] = options.board, j["square_mm"] = options.square_mm;
  j["model"] = c.model.name, j["choice"] = summary.fit.choice;
  j["views_used"] = summary.fit.views.size();
  j["views_refused"] = ordered_json::array();
  for (const auto* refused : {&summary.gathered.refused, &summary.fit.refused})
    for (const RefusedView& r : *refused) j["views_refused"].push_back({{"name", r.name}, {"reason", r.reason}});
  j["pictures"] = summary.gathered.pictures, j["pictures_searched"] = summary.gathered.searched;
  j["pictures_without_board"] = summary.gathered.without_board, j["pictures_redundant"] = summary.gathered.redundant;
  j["corners_left_out"] = summary.fit.corners_left_out;
  j["coverage"] = summary.fit.coverage;
  j["uncertainty_median_px"] = summary.uncertainty.median_px, j["uncertainty_largest_px"] = summary.uncertainty.largest_px;
  const auto colmap = ColmapCameraOf(k);
  j["colmap_model"] = colmap ? ordered_json(colmap->model) : ordered_json();
  j["colmap_params"] = colmap ? ordered_json(colmap->params) : ordered_json();
  j["views"] = ordered_json::array();
  for (std::size_t v = 0; v < summary.fit.views.size(); ++v) j["views"].push_back({{"name", summary.fit.views[v].name}, {"rms_px", c.view_rms_px[v]}});
  j.update(ordered_json::parse(JsonTextOf(ModelTable(summary.fit))));
  if (!summary.tradeoff.empty()) {
    j["tradeoff"] = ordered_json::parse(JsonTextOf(ViewCountTable(summary.tradeoff)))["views"];
    j["tradeoff_json"] = summary.tradeoff_files.json.string(), j["tradeoff_svg"] = summary.tradeoff_files.svg.string();
  }
  j["undistorted"] = summary.undistorted;
  j["output"] = summary.output.string(), j["report"] = summary.report.string();
  j["seconds_boards"] = summary.gathered.seconds, j["seconds"] = summary.seconds;
  return j.dump();
}

std::string DescribeCalibration(const std::string& text) {
  const ordered_json j = ordered_json::parse(text);
  std::string s = fmt::format("{} of {} pictures with a {} board are used, {}x{} pixels\n\n", j["views_used"].get<int>(), j["pictures"].get<int>(),
                              j["board"].get<std::string>(), j["width_px"].get<int>(), j["height_px"].get<int>());
  for (const char* name : {"fx", "fy", "cx", "cy", "skew", "k1", "k2", "p1", "p2", "k3"}) {
    const double sigma = j[std::string("sigma_") + name];
    s += sigma > 0 ? fmt::format("{:>5} {:12.5f} +- {:.5f}\n", name, j[name].get<double>(), sigma) : fmt::format("{:>5} {:12.5f}    held\n", name, j[name].get<double>());
  }
  const auto number = [](const ordered_json& x) { return x.is_null() ? std::string("-") : fmt::format("{:.4f}", x.get<double>()); };
  s += fmt::format("\nRMS {:.4f} px, cross-validated {} px, projection uncertain by {:.3f} px (median), {:.3f} px (largest)\n", j["rms_px"].get<double>(),
                   number(j["cross_validated_rms_px"]), j["uncertainty_median_px"].get<double>(), j["uncertainty_largest_px"].get<double>());
  const auto table = [](TradeoffTable empty, const ordered_json& rows) {
    AddRows(rows, empty);
    return "\n" + TextOf(empty) + "\n";
  };
  s += table(ModelTable(), j["models"]) + fmt::format("* {}\n", j["choice"].get<std::string>());
  if (j.contains("tradeoff")) s += table(ViewCountTable(), j["tradeoff"]);
  if (!j["views_refused"].empty()) s += "\nrefused:\n";
  for (const auto& r : j["views_refused"]) s += fmt::format("  {}: {}\n", r["name"].get<std::string>(), r["reason"].get<std::string>());
  s += j["colmap_model"].is_null() ? std::string("\nCOLMAP: no model of its has skew: undistort the photos (--undistort)\n")
                                   : fmt::format("\nCOLMAP: --ImageReader.camera_model {} --ImageReader.camera_params {}\n", j["colmap_model"].get<std::string>(),
                                                 j["colmap_params"].get<std::string>());
  s += fmt::format("{} and {}, {:.1f} s", j["output"].get<std::string>(), j["report"].get<std::string>(), j["seconds"].get<double>());
  return s;
}

}  // namespace lumi
