#include "calibrate/calibrate.h"

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <map>

#include "calibrate/report.h"
#include "scene/files/atomic_file.h"
#include "scene/files/camera_yaml.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "scene/undistort/undistorter.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr int kMostCorners = 200;  // along a side of a board

// Checks that all outputs may be written, before anything is computed.
void RequireOutputs(const CalibrateOptions& options, const CalibrateSummary& summary) {
  if (options.output.empty() || options.output.filename().empty() || fs::is_directory(options.output))
    throw UsageError(fmt::format("{} is no name of a file", options.output.string()), "-o camera.yaml");
  if (const std::string ending = options.output.extension().string(); ending != ".yaml" && ending != ".yml")
    throw UsageError(fmt::format("{}: the output is a .yaml file", options.output.string()), "-o camera.yaml");
  if (fs::exists(summary.report) &&
      (fs::is_directory(summary.report) || ReadText(summary.report).find(kReportMark) == std::string::npos))
    throw UsageError(fmt::format("{} is there already and not a report of this program", summary.report.string()),
                     "name another with --report");
  for (const fs::path& file : {options.output, summary.report}) {
    RequireWritable(file);
    RemoveStaleTemporariesOf(file);
  }
  if (!options.undistort.empty()) {
    RequireOurFolder(options.undistort, "camera.yaml");
    RequireWritable(options.undistort / "camera.yaml");
    if (fs::exists(options.input) && fs::exists(options.undistort) && fs::equivalent(options.input, options.undistort))
      throw UsageError("the undistorted photos would replace the photos", "name another folder with --undistort");
    if (fs::weakly_canonical(options.output) == fs::weakly_canonical(options.undistort / "camera.yaml"))
      throw UsageError(fmt::format("{} would hold both the photos' camera and that of the undistorted ones",
                                   options.output.string()),
                       "name another file with -o, or another folder with --undistort");
  }
}

// A name for one of several photos that differ by their ending: with it, and in the 255 bytes that a name may have.
std::string UnlikeOthers(const fs::path& photo) {
  const std::string name = photo.filename().string();
  constexpr std::size_t kLongest = 250, kKept = 180;
  return name.size() <= kLongest ? name : name.substr(0, kKept) + "-" + HashOf(name);
}

// Photos that show the calibrated camera's picture: all of its size, with or without a board; of a video the frames
// used.
int WriteUndistorted(const CalibrateOptions& options, const CalibrateSummary& summary, ProgressSink& progress) {
  const int width = summary.gathered.width_px, height = summary.gathered.height_px;
  const Camera camera = CameraOf(summary.fit.calibration.intrinsics, width, height);
  const Camera pinhole = PinholeInside(camera);
  const Undistorter undistort(camera, pinhole);
  fs::create_directories(options.undistort);
  // Written first: by this file a later run recognises the folder as its own.
  WriteCameraYaml(pinhole, options.undistort / "camera.yaml");
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
      if (used.contains(fmt::format("frame {:06d}", frame->index)))
        write(fmt::format("frame_{:06d}", frame->index), frame->rgb), task.Step();
  } else {
    const auto photos = PhotosOf(options.input);
    Progress task(progress, "undistorted", static_cast<long>(photos.size()));
    std::map<std::string, int> stems;
    for (const fs::path& photo : photos) ++stems[photo.stem().string()];
    for (const fs::path& photo : photos) {
      task.Step();
      try {
        write(stems[photo.stem().string()] > 1 ? UnlikeOthers(photo) : photo.stem().string(), ReadImage8(photo));
      } catch (const InputError&) {
        // Already named among the refused photos.
      }
    }
  }
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
    throw UsageError(fmt::format("--board {}: a board has 3 to {} inner corners along a side", text, kMostCorners),
                     "--board counts where four squares meet");
  if (!(square_mm > 0) || !std::isfinite(square_mm)) throw UsageError("--square-mm has to be above 0");
  board.square_mm = square_mm;
  return board;
}

std::optional<ColmapCamera> ColmapCameraOf(const Intrinsics& k) {
  if (k[kSkew] != 0) return std::nullopt;
  const std::string pinhole =
      fmt::format("{:.10g},{:.10g},{:.10g},{:.10g}", k[kFx], k[kFx] * k[kAspect], k[kCx], k[kCy]);
  if (k[kK3] != 0)
    return ColmapCamera{"FULL_OPENCV", pinhole + fmt::format(",{:.10g},{:.10g},{:.10g},{:.10g},{:.10g},0,0,0", k[kK1],
                                                             k[kK2], k[kP1], k[kP2], k[kK3])};
  if (k.segment<kK3 - kK1>(kK1).isZero(0)) return ColmapCamera{"PINHOLE", pinhole};
  return ColmapCamera{"OPENCV",
                      pinhole + fmt::format(",{:.10g},{:.10g},{:.10g},{:.10g}", k[kK1], k[kK2], k[kP1], k[kP2])};
}

CalibrateSummary Calibrate(const CalibrateOptions& options, ProgressSink& progress) {
  const auto begin = std::chrono::steady_clock::now();
  const Board board = ParseBoard(options.board, options.square_mm);
  if (const std::string problem = options.fit.Problem(); !problem.empty()) throw UsageError(problem);
  CalibrateSummary summary;
  summary.board = options.board;
  summary.square_mm = options.square_mm;
  summary.output = options.output;
  summary.report = options.report.empty() ? options.output.parent_path() / "report.html" : options.report;
  RequireOutputs(options, summary);

  summary.gathered = GatherBoards(options.input, board, options.gather, progress);
  const int width = summary.gathered.width_px, height = summary.gathered.height_px;
  summary.fit = Fit(board, summary.gathered.views, width, height, options.fit);
  summary.uncertainty = ProjectionUncertainty(summary.fit.calibration, width, height);
  if (options.tradeoff) summary.tradeoff = ViewCountTradeoff(board, summary.fit, options.seed);
  // Before the photos, which may fill the disk.
  WriteCameraYaml(CameraOf(summary.fit.calibration.intrinsics, width, height), options.output);
  if (!options.undistort.empty()) summary.undistorted = WriteUndistorted(options, summary, progress);
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (options.tradeoff) {
    const TradeoffTable table = ViewCountTable(summary.tradeoff);
    summary.tradeoff_files =
        WriteTradeoff(fs::path(options.output).replace_extension(".tradeoff"), table, ViewCountPlots(table),
                      KeysOf(table).Append(KeysOf(ModelTable(summary.fit))).Text(2) + "\n");
  }
  WriteTextAtomically(summary.report, ReportHtml(options, summary));
  return summary;
}

}  // namespace lumi
