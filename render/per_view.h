// A proxy of its own for each frame (thesis sec. 6.2.3): structure points triangulated in the virtual view. It needs no mesh, in any
// frame of the world, and it is the proxy of scenes that have points but no metric.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "render/renderer.h"
#include "scene/view_triangulation/view_triangulation.h"

namespace lumi {

constexpr const char* kPerViewProxy = "per-view";  // as the name of a proxy on the command line

class PerViewProxy {
 public:
  // Throws DataError for a scene without a point that can be trusted.
  explicit PerViewProxy(const Scene& scene, const ViewTriangulationOptions& options = {});
  // In world. Empty where the view has no point in front of it.
  Mesh For(const RenderView& view) const;
  std::size_t points() const { return X_.size(); }

 private:
  ViewTriangulationOptions options_;
  std::vector<Eigen::Vector4d> X_;
  std::optional<Plane> plane_at_infinity_;
};

// Gives `renderer` the view's own proxy before each picture. Nothing hides anything: what a photo sees of a surface that was made
// for another view is not known. `proxy` must outlive it. Statistics::plan_ms has the triangulation in it.
std::unique_ptr<Renderer> MakePerViewRenderer(const PerViewProxy& proxy, std::unique_ptr<Renderer> renderer);

}  // namespace lumi
