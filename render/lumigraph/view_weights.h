// What a picture is blended from: the photos, weights and points of any of its pixels. Renderers compute these tile by
// tile and keep none; this is for whoever asks.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "render/lumigraph/lumigraph.h"
#include "render/radiance/frame_plan.h"
#include "render/world/visibility_maps.h"

namespace lumi {

// Of a picture of height x width pixels, row by row.
struct ViewPlan {
  int width = 0, height = 0, k = 0;
  std::vector<std::int32_t> photo;  // k a pixel: numbers of the scene's views, -1 past the last
  std::vector<float> weight;        // k a pixel; sum 1 where alpha > 0, the optimum's may be negative
  std::vector<float> alpha;         // 0: a hole
  // 3 a pixel: where its ray meets the proxy, world units; NaN where it does not, and everywhere where each picture has
  // a proxy and a world of its own.
  std::vector<double> point;
  // Of that place, along the view's axis: world units, or those of the picture's own world. NaN: the proxy is missed.
  std::vector<double> depth;
};

// At points of the picture.
struct WeightsAtRays {
  WeightTable table;          // its cameras are numbers of the scene's views
  std::vector<double> point;  // as ViewPlan has it
};

class ViewWeights {
 public:
  // `settings`: at the view's moment (Lumigraph::At); their grid of sparse samples does not count. `traced`: of the
  // lumigraph's one mesh, where the caller keeps it for many views; nullptr: made here. It and the lumigraph must
  // outlive this.
  ViewWeights(const Lumigraph& lumigraph, const RenderView& view, const std::vector<bool>& use,
              const RadianceSettings& settings, const TracedProxy* traced = nullptr);

  ViewPlan Plan() const;  // parallel
  // The share of the picture that each view of the scene gives, by weights: they sum to the picture's coverage.
  // Negative weights count as what they take away. Keeps no plan.
  std::vector<double> Shares(std::size_t views) const;
  // x_px: pixels, centres at (i + 0.5, j + 0.5).
  WeightsAtRays At(const std::vector<Eigen::Vector2d>& x_px) const;

 private:
  // body(plan) of each tile, on all threads; cameras are views of the scene there.
  void ForTiles(const std::function<void(const FramePlan&)>& body) const;
  void Place(const FramePlan& tile, ViewPlan& whole) const;
  void NumberAsViews(std::vector<std::int32_t>& cameras) const;
  const Eigen::Vector2i size_px_;
  std::unique_ptr<TracedProxy> own_;
  const TracedProxy* traced_;
  std::vector<std::int32_t> photos_;  // the scene's view, a camera; empty: the same numbers
  std::optional<Similarity3> world_from_normalized_;
  const VisibilityMaps* visibility_ = nullptr;
  ViewSetup setup_;
};

}  // namespace lumi
