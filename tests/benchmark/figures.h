// The figures of one capture, measured by running the programs as a user does.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/geometry/similarity3.h"
#include "scene/program/progress.h"
#include "tests/benchmark/captures.h"

namespace lumi {

// How well a photo comes back at its own camera, over the photos looked at.
struct Reproduction {
  double worst_mean_absolute = 0;  // code values of 255, where the proxy is seen; the worst photo's mean
  double mean_absolute = 0;        // over photos
};

struct CaptureFigures {
  std::string name;
  int images_total = 0, images_registered = 0;
  double reprojection_px = 0;
  std::string proxy;
  // Held out, N = 8; over the pixels that two photos see where there are any.
  double psnr_db = 0, ssim = 0, coverage = 0, nearest_psnr_db = 0, nearest_coverage = 0;
  std::optional<double> psnr_seen_db, seen, nearest_psnr_seen_db;
  double ms_per_frame = 0;
  double colmap_s = 0, around_colmap_s = 0;
  std::optional<PoseErrors> poses;
  int reproduced_views = 0;
  Reproduction cpu;
  std::optional<Reproduction> gl;              // absent: no OpenGL here
  std::optional<double> cpu_gl_worst_psnr_db;  // of the same views without their own photos, CPU against GL
};

// Runs lumi-pipeline into work/NAME (what is there is reused) and lumi-render at up to `views` of the photos' own
// cameras. Throws Error where a program fails.
CaptureFigures MeasureCapture(const BenchCapture& capture, const std::filesystem::path& work, int views,
                              ProgressSink& progress);

// The desk of 24 photos, 640 pixels wide, simulated into `folder` (reused where it is there).
void SimulateDesk(const std::filesystem::path& folder, ProgressSink& progress);

std::string ToMarkdown(const std::vector<CaptureFigures>& figures);
std::string ToJson(const std::vector<CaptureFigures>& figures);

}  // namespace lumi
