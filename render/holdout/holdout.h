// Held-out error: photos 0, N, 2N ... (or each in turn) are rendered from the others and compared with the photographs,
// over all pixels (a hole counts as black) and over the pixels that at least two of the others see. The baseline is the
// nearest photo alone, reprojected through the same proxy. Renders are compared as they come from the renderer, rounded
// to 8 bits, never as files that were read back.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "render/world/renderer.h"
#include "scene/program/progress.h"

namespace lumi {

// In place of N: every photo is left out in turn and rendered from all the others.
constexpr int kHoldoutEach = -1;

struct HoldoutOptions {
  int n = 8;                  // every n-th photo is held out; or kHoldoutEach
  Fold fold = Fold::kReport;  // kHoldoutEach has only one
  int width_px = 0;           // 0: the photo's own size
  RadianceSettings settings;
  bool own_times = true;         // each view is rendered at its photo's time, where it has one; else at settings.time_s
  std::filesystem::path folder;  // renders and differences go here; empty: none are written
};

struct HoldoutScore {
  double psnr_db = 0, ssim = 0, coverage = 0;
  // Over the object's pixels, if the scene has the photo's silhouette: a hull cannot show the background.
  std::optional<double> psnr_object_db = {};
  // Over the pixels that at least two of the photos in use see; none if there is no such pixel, or it was not asked
  // for.
  std::optional<double> psnr_seen_db = {};
};

// What a held-out photo's pictures are called, after HoldoutView::file.
inline constexpr const char *kRenderEnding = "_render.jpg", *kDifferenceEnding = "_difference.jpg";

struct HoldoutView : HoldoutScore {
  ViewId photo;
  std::string name, nearest_name;
  HoldoutScore nearest;        // of the nearest photo alone, over the same pixels
  std::optional<double> seen;  // share of the pixels that at least two of the photos in use see
  double ms = 0;               // to render the view
  std::string file;            // what its pictures' names begin with
};

struct HoldoutSummary {
  HoldoutScore mean, nearest_mean;  // over the views; the object's and the seen pixels' over those that have them
  std::optional<double> seen;       // mean
  double ms_per_frame = 0;          // median
  long samples = 0;                 // rays at which weights were computed, and the optimum's counts: sums over the
  OptimumCounts optimum;            // held-out views, without the baseline
  int halved = 0;                   // the most often that a view's photos were halved, for lack of memory
  std::vector<HoldoutView> views;
};

// The photo closest to `view` among those not held out: the angle the baseline subtends at the view's median point
// depth plus the angle between the optical axes (without a metric in the world of the view's own vanishing points),
// plus, if the settings count time, the time term that rays are weighed with.
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
// A fold's views at most this wide, rendered from all other photos, or from all if no others are left. kHoldoutEach:
// the views of every fifth photo, from all the others: a view that may use its own photo would only show that photo.
DesiredViews LeaveOut(const Scene& scene, int n, Fold fold, int width_px);
// The photos that a fold is rendered from: none of its own, and none of their twins (photo_twins.h). The choosing fold
// also leaves out the reporting one (settings must not be chosen with photos that are reported on), unless that leaves
// less than half of all photos. Throws DataError if nothing is left.
std::vector<bool> PhotosWithout(const Scene& scene, int n, Fold fold);

// What a held-out photo is rendered with.
struct HoldoutRenderer {
  Renderer* renderer = nullptr;
  // The pixels of a view that at least two of these photos see (SeenPixels::Mask); empty: no figures over them.
  std::function<Image8(const RenderView& view, const std::vector<bool>& use)> seen = {};
};
// Photos may need different renderers, because each proxy was made without other photos. `renderer_of` is called once
// for each photo, in order; for kHoldoutEach, all photos that share a proxy (photo mod kProxiesForEach) follow one
// another. Its earlier results need not stay valid. Throws DataError if too few photos are left.
using HoldoutRendererOf = std::function<HoldoutRenderer(ViewId photo)>;
HoldoutSummary EvaluateHoldout(const Scene& scene, const HoldoutRendererOf& renderer_of, const HoldoutOptions& options,
                               ProgressSink& progress);
// The same with one renderer for all photos, without the figures over seen pixels.
HoldoutSummary EvaluateHoldout(const Scene& scene, Renderer& renderer, const HoldoutOptions& options,
                               ProgressSink& progress);

}  // namespace lumi
