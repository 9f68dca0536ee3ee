#include "render/radiance/frame_plan.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "render/radiance/optimum/keep_largest.h"
#include "render/radiance/reconstruct.h"
#include "scene/geometry/dense_solvers.h"

namespace lumi {

ViewSetup MakeViewSetup(const Sources& sources, const RenderView& desired, const RadianceSettings& settings,
                        const std::vector<bool>& use) {
  if (const std::string problem = Validate(settings); !problem.empty()) throw std::invalid_argument(problem);
  if (!use.empty() && use.size() != sources.views.size())
    throw std::invalid_argument("MakeViewSetup: one flag a source view is wanted");
  ViewSetup setup;
  setup.settings = settings;
  setup.desired = Normalized(desired, sources.normalized_from_world);
  setup.sources = MakeRelative(sources, setup.desired, use, settings.fov_feather);
  Eigen::Matrix3d M = setup.desired.P.leftCols<3>();
  M /= M.row(2).norm();
  const auto inverse = InverseOf(M);
  if (!inverse) throw std::invalid_argument("MakeViewSetup: the desired camera's matrix is singular");
  setup.desired.P.leftCols<3>() = M;
  setup.desired.P.col(3) = -M * setup.desired.centre;
  setup.ray_from_pixel = *inverse;
  setup.focal_px = static_cast<float>(std::sqrt(std::abs(M.determinant())));
  return setup;
}

namespace {

// Weights below this part of the optimum's accuracy are not blended: these are half of a row's photos, and their effect
// is invisible.
constexpr double kUnseenWeight = 0.01;

// Rows of a table, padded to the longest, or to `least`.
void Pad(const WeightTable& table, std::size_t least, FramePlan& plan) {
  std::size_t k = least;
  for (std::size_t s = 0; s < table.size(); ++s)
    k = std::max(k, static_cast<std::size_t>(table.first[s + 1] - table.first[s]));
  plan.k = static_cast<int>(k);
  plan.camera.assign(table.size() * k, -1);
  plan.weight.assign(table.size() * k, 0.0F);
  for (std::size_t s = 0; s < table.size(); ++s) {
    const auto first = static_cast<std::size_t>(table.first[s]),
               count = static_cast<std::size_t>(table.first[s + 1]) - first;
    std::copy_n(table.camera.data() + first, count, plan.camera.data() + s * k);
    std::copy_n(table.weight.data() + first, count, plan.weight.data() + s * k);
  }
}

}  // namespace

void PlanPixels(const ViewSetup& setup, const ProxyTracer& proxy, const VisibilityMaps* visibility,
                const PixelWindow& window, FramePlan& plan, WeighScratch& scratch) {
  const RadianceSettings& settings = setup.settings;
  const auto n = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
  plan.window = window;
  plan.optimum = {};
  RaySamples rays;
  rays.t.resize(n);
  rays.exact_direction.reserve(n);
  rays.direction.reserve(n);
  for (int y = 0; y < window.height; ++y)
    for (int x = 0; x < window.width; ++x) {
      rays.exact_direction.push_back(
          (setup.ray_from_pixel * Eigen::Vector3d(window.x + x + 0.5, window.y + y + 0.5, 1.0)).normalized());
      rays.direction.push_back(rays.exact_direction.back().cast<float>());
    }
  rays.normal.resize(settings.resolution == Resolution::kJacobian || settings.prefilter || setup.method ? n : 0);
  rays.face.resize(n);
  proxy.Trace(setup.desired.centre.cast<float>(), rays.direction, rays.t, rays.normal, rays.face);
  const bool full = settings.similarity == Similarity::kFull;
  rays.exact_t.resize(full ? 0 : n);
  for (std::size_t s = 0; s < rays.exact_t.size(); ++s)
    if (rays.t[s] > 0 && std::isfinite(rays.t[s]))
      rays.exact_t[s] = proxy.Refined(rays.face[s], setup.desired.centre, rays.exact_direction[s], rays.t[s]);
  if (setup.method) setup.method->Meet(rays);

  WeightTable table;
  Reconstruct(setup, visibility, rays, table, plan.optimum, scratch);
  if (full) DropSmall(table, static_cast<float>(kUnseenWeight * std::min(settings.accuracy, 0.01)));
  Pad(table, full || setup.method ? 0 : static_cast<std::size_t>(settings.k), plan);
  plan.alpha = std::move(table.alpha);
  plan.offset = std::move(rays.direction);
  plan.normal = std::move(rays.normal);
  for (std::size_t s = 0; s < n; ++s)
    if (plan.alpha[s] > 0) plan.offset[s] *= rays.t[s];
}

}  // namespace lumi
