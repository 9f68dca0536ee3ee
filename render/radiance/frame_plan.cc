#include "render/radiance/frame_plan.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "render/radiance/optimum.h"
#include "render/radiance/optimum/keep_largest.h"
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

// Weights below this part of the optimum's accuracy are not blended: half of a row's photos, and none that shows.
constexpr double kUnseenWeight = 0.01;

// The optimum's rows, padded to the longest; plan.offset still holds unit directions.
void PlanOptimum(const ViewSetup& setup, const VisibilityMaps* visibility, const std::vector<float>& t, FramePlan& plan) {
  const RaySamples rays{plan.offset, t, plan.normal};
  WeightTable table;
  WeighOptimal(setup, visibility, rays, table, plan.optimum);
  DropSmall(table, static_cast<float>(kUnseenWeight * std::min(setup.settings.accuracy, 0.01)));
  std::size_t k = 0;
  for (std::size_t s = 0; s < table.size(); ++s) k = std::max(k, static_cast<std::size_t>(table.first[s + 1] - table.first[s]));
  plan.k = static_cast<int>(k);
  plan.alpha = std::move(table.alpha);
  plan.camera.assign(plan.alpha.size() * k, -1);
  plan.weight.assign(plan.alpha.size() * k, 0.0F);
  for (std::size_t s = 0; s < plan.alpha.size(); ++s) {
    if (plan.alpha[s] > 0) plan.offset[s] *= t[s];
    const auto first = static_cast<std::size_t>(table.first[s]), count = static_cast<std::size_t>(table.first[s + 1]) - first;
    std::copy_n(table.camera.data() + first, count, plan.camera.data() + s * k);
    std::copy_n(table.weight.data() + first, count, plan.weight.data() + s * k);
  }
}

}  // namespace

void PlanPixels(const ViewSetup& setup, const ProxyTracer& proxy, const VisibilityMaps* visibility,
                const PixelWindow& window, FramePlan& plan, WeighScratch& scratch) {
  const auto n = static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height);
  const bool all = setup.settings.k == 0;
  plan.window = window;
  plan.k = all ? setup.sources.count : setup.settings.k;
  const auto k = static_cast<std::size_t>(plan.k);
  plan.offset.resize(n);
  plan.alpha.resize(n);
  plan.optimum = {};

  std::vector<float> t(n), everyone;
  std::vector<Eigen::Vector3d> ray(n);
  std::size_t s = 0;
  for (int y = 0; y < window.height; ++y)
    for (int x = 0; x < window.width; ++x) {
      ray[s] = (setup.ray_from_pixel * Eigen::Vector3d(window.x + x + 0.5, window.y + y + 0.5, 1.0)).normalized();
      plan.offset[s] = ray[s].cast<float>();
      ++s;
    }
  plan.normal.resize(setup.settings.resolution == Resolution::kJacobian || setup.settings.prefilter ? n : 0);
  std::vector<std::int32_t> face(n);
  proxy.Trace(setup.desired.centre.cast<float>(), plan.offset, t, plan.normal, face);

  if (setup.settings.similarity == Similarity::kFull) {
    PlanOptimum(setup, visibility, t, plan);
    return;
  }
  plan.camera.assign(n * k, -1);
  plan.weight.assign(n * k, 0.0F);
  for (s = 0; s < n; ++s) {
    plan.alpha[s] = 0;
    if (!(t[s] > 0) || !std::isfinite(t[s])) continue;
    const Eigen::Vector3f direction = plan.offset[s];
    const Eigen::Vector3f facing = plan.normal.empty() ? Eigen::Vector3f::Zero() : plan.normal[s];
    plan.offset[s] *= t[s];
    if (all) {
      plan.alpha[s] = WeighAll(setup.sources, visibility, direction, t[s], setup.settings, scratch, everyone, facing);
      for (std::size_t j = 0; j < everyone.size(); ++j)
        if (everyone[j] > 0) {
          plan.camera[s * k + j] = static_cast<std::int32_t>(j);
          plan.weight[s * k + j] = everyone[j];
        }
      continue;
    }
    const RayWeights r = Weigh(setup.sources, visibility, ray[s], proxy.Refined(face[s], setup.desired.centre, ray[s], t[s]), setup.settings, scratch, facing);
    plan.alpha[s] = r.alpha;
    for (std::size_t i = 0; i < static_cast<std::size_t>(r.count); ++i) {
      plan.camera[s * k + i] = r.camera[i];
      plan.weight[s * k + i] = r.weight[i];
    }
  }
}

}  // namespace lumi
