// lumi-calibrate: photos or a video of a checkerboard in, camera.yaml and a report out.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "calibrate/fit.h"
#include "calibrate/gather.h"
#include "calibrate/uncertainty.h"
#include "scene/files/json_keys.h"
#include "scene/program/progress.h"
#include "scene/tradeoff/table.h"

namespace lumi {

struct CalibrateOptions {
  std::filesystem::path input;
  std::string board = "9x6";  // inner corners, columns x rows
  double square_mm = 25;      // > 0; scales the poses, not the intrinsics
  std::filesystem::path output = "camera.yaml";
  std::filesystem::path report;     // empty: report.html beside the output
  std::filesystem::path undistort;  // empty: none
  bool tradeoff = false;            // also over the number of views; OUTPUT's name with .tradeoff.json, .csv and .svg
  FitOptions fit;
  GatherOptions gather;
  std::uint64_t seed = 0;
};

struct CalibrateSummary {
  Gathered gathered;
  FitResult fit;
  UncertaintyMap uncertainty;
  std::vector<ViewCountTrial> tradeoff;
  int undistorted = 0;
  double seconds = 0;
  std::filesystem::path output, report;
  TradeoffFiles tradeoff_files;
  std::string board;  // as it was asked for
  double square_mm = 0;
};

// COLMAP's camera: "OPENCV" and "fx,fy,cx,cy,k1,k2,p1,p2"; FULL_OPENCV where there is a k3, PINHOLE where there is no
// distortion. Nothing with skew: no model of COLMAP's has one.
struct ColmapCamera {
  std::string model, params;
};
std::optional<ColmapCamera> ColmapCameraOf(const Intrinsics& intrinsics);

// "9x6" -> board; throws UsageError.
Board ParseBoard(const std::string& text, double square_mm);

// Throws UsageError, InputError, DataError, MachineError; then nothing is written.
CalibrateSummary Calibrate(const CalibrateOptions& options, ProgressSink& progress);

void ListKeys(JsonKeys& j, CalibrateSummary& summary);
// For a person: parameters with their standard deviations, the table of models, of views, what was refused.
std::string Describe(const CalibrateSummary& summary);

}  // namespace lumi
