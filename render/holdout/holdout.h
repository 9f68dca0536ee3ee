// How good the lumigraph is where it can be checked: photos 0, N, 2N ... rendered from the others and compared with
// what was photographed, over all pixels, a hole counting as black; beside it the nearest photo alone, reprojected
// through the same proxy.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/world/renderer.h"
#include "scene/program/progress.h"

namespace lumi {

struct HoldoutOptions {
  int n = 8;  // every n-th photo is held out
  Fold fold = Fold::kReport;
  int width_px = 0;  // 0: the photo's own size
  RadianceSettings settings;
  bool own_times = true;         // each view is rendered at its photo's time, where it has one; else at settings.time_s
  std::filesystem::path folder;  // renders and differences go here; empty: none are written
};

struct HoldoutScore {
  double psnr_db = 0, ssim = 0, coverage = 0;
  // Over the object's pixels, where the scene has the photo's silhouette: what lies around it no hull can show.
  std::optional<double> psnr_object_db = {};
};

struct HoldoutView : HoldoutScore {
  std::string name, nearest_name;
  HoldoutScore nearest;  // of the nearest photo alone
  double ms = 0;         // to render the view
};

struct HoldoutSummary {
  HoldoutScore mean, nearest_mean;  // over the views; the object's over those that have it
  double ms_per_frame = 0;          // median
  long samples = 0;       // rays at which weights were computed, and what the optimum says of them: sums over the
  OptimumCounts optimum;  // held-out views, without the baseline
  std::vector<HoldoutView> views;
};

// The photo closest to `view` among those not held out: the angle the baseline subtends at the view's median point
// depth plus the angle between the optical axes (without a metric in the world of the view's own vanishing points),
// plus, where the settings count time, what its own time is off, as rays are weighed.
ViewId NearestPhoto(const Scene& scene, ViewId view, const std::vector<bool>& use, const RadianceSettings& settings);

// The photo's own view at this size, with its time and exposure.
RenderView PhotosView(const Scene& scene, const View& view, const Eigen::Vector2i& size_px);
// The same at most this wide (0: at its own size).
RenderView HeldOutView(const Scene& scene, const View& view, int width_px);

// What will be rendered, and from which photos (empty: all).
struct DesiredViews {
  std::vector<RenderView> views;
  std::vector<bool> use;
};
// A fold's views at most this wide, from all other photos; from all where nothing is left.
DesiredViews LeaveOut(const Scene& scene, int n, Fold fold, int width_px);
// The photos that a fold is rendered from: none of its own; for the choosing fold nor any of the reporting one (what is
// chosen must not have seen the photos that are reported on), unless that leaves less than half of all. Throws
// DataError where nothing is left.
std::vector<bool> PhotosWithout(const Scene& scene, int n, Fold fold);

HoldoutSummary EvaluateHoldout(const Scene& scene, Renderer& renderer, const HoldoutOptions& options,
                               ProgressSink& progress);

}  // namespace lumi
