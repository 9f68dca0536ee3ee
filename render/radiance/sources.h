// The source cameras as the radiance core reads them: in the scene's normalised frame (centre at the origin, size about
// 1), so that float arithmetic relative to the desired camera keeps its digits.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "render/radiance/measures/list.h"
#include "scene/model/scene.h"

namespace lumi {

// Of each measure, by its place in the list.
using PhotoFields = std::array<PhotoField, MeasureList::kCount>;

struct Sources {
  std::vector<RenderView> views;  // P and centre in the normalised frame; same order as Scene::views
  Similarity3 normalized_from_world;
  std::shared_ptr<const PhotoFields> fields = std::make_shared<const PhotoFields>();
};

Sources MakeSources(const Scene& scene);
// Gathers the views' grids. Throws std::invalid_argument where grids of one measure differ in size.
void TakeFields(Sources& sources);

// A view of the world frame in the normalised one. P keeps its sign.
RenderView Normalized(const RenderView& view, const Similarity3& normalized_from_world);

// Where the corners of a view's picture lie at this depth along its axis, around the picture from the first pixel's.
std::array<Eigen::Vector3d, 4> CornersAt(const RenderView& view, double depth);

// The sources as seen from one desired camera, a structure of arrays: everything is relative to the desired centre, the
// differences formed in double. Padded to a multiple of kLanes with cameras that see nothing.
struct RelativeSources {
  static constexpr int kLanes = 16;
  double time_origin_s = 0;
  float desired_m[9] = {};  // M of the desired camera, scaled likewise
  float desired_focal_px = 1;
  int count = 0;   // real cameras
  int padded = 0;  // arrays' length
  // C_j - C_desired, normalised units.
  std::vector<float> dx, dy, dz;
  // M_j = P_j's left 3x3, rows: x_px ~ M_j (t d - D_j), scaled so that w is the depth in normalised units.
  std::vector<float> m[9];
  std::vector<float> width_px, height_px, feather_px;
  std::vector<float> focal_px;  // sqrt(fx fy): for the pyramid level
  std::vector<float> dt_s;      // the photo's time less the first photo's that has one; 0 where it has none ...
  std::vector<float> timed;     // ... and 0 here, else 1
  std::vector<float> gain;      // the desired view's exposure over the photo's own
  // D, M, width, height, feather of camera j in double, kExact values from kExact j: floats find the nearest cameras,
  // doubles weigh them.
  static constexpr std::size_t kExact = 15;
  std::vector<double> exact;
  std::vector<std::int32_t> view;  // index into Sources::views: not j in a Subset
  std::shared_ptr<const PhotoFields> fields = std::make_shared<const PhotoFields>();  // indexed by `view`
  std::vector<float> enabled;  // 1, or 0 for a camera that is left out (held out, padding)
};

// `use[j]` false leaves camera j out (empty: all are used). `desired` in the normalised frame.
RelativeSources MakeRelative(const Sources& sources, const RenderView& desired, const std::vector<bool>& use,
                             double fov_feather);

// Those of `all` that `photos` lists, in that order. Replaces `subset`, reusing its memory.
void Subset(const RelativeSources& all, std::span<const std::int32_t> photos, RelativeSources& subset);

}  // namespace lumi
