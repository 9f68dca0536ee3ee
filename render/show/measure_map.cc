#include "render/show/measure_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "render/radiance/frame_plan.h"
#include "render/world/visibility_maps.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr std::array<std::string_view, 7> kNames = {"weights", "angle", "fov", "resolution", "visibility", "time", "dissimilarity"};

constexpr float kNothing = -1;  // no value: the proxy is missed, or no photo sees the point

float Value(Measure measure, std::size_t j, const ViewSetup& setup, const Measures& m, float weight) {
  const RadianceSettings& s = setup.settings;
  const auto unit = static_cast<float>(2 * s.r_max_rad);
  switch (measure) {
    case Measure::kWeight: return weight;
    case Measure::kAngle: return m.theta[j] / static_cast<float>(kRadiansPerDegree);
    case Measure::kFieldOfView: return m.f[j];
    case Measure::kResolution: return m.r[j];
    case Measure::kVisibility: return m.v[j];
    case Measure::kTime: return m.tau[j] * static_cast<float>(s.time_window_s) / 2;
    case Measure::kDissimilarity: break;
  }
  if (!(m.f[j] > 0)) return kNothing;
  float g = static_cast<float>(s.alpha) * m.theta[j];
  if (s.resolution != Resolution::kOff) g += static_cast<float>(s.beta) * unit * (1 - m.r[j]);
  if (s.time) g += static_cast<float>(s.epsilon) * unit * m.tau[j];
  const float v = s.visibility ? m.v[j] : 1.0F;
  return g * (1 + static_cast<float>(s.gamma) * (1 / (m.f[j] * v) - 1)) / static_cast<float>(kRadiansPerDegree);
}

}  // namespace

std::optional<Measure> MeasureFromName(std::string_view name) {
  const auto* found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<Measure>(found - kNames.begin());
}

MeasureMap RenderMeasureMap(const Scene& scene, const Mesh& proxy, const RenderRequest& request, Measure measure, int source) {
  const Sources sources = MakeSources(scene);
  const ProxyTracer tracer(proxy, scene.normalized_from_world);
  return RenderMeasureMap(sources, tracer, CanOcclude(proxy) ? MakeVisibilityMaps(sources, tracer) : VisibilityMaps(), request, measure, source);
}

MeasureMap RenderMeasureMap(const PictureWorld& world, RenderRequest request, Measure measure, int source) {
  request.view = world.view;
  const std::vector<bool> wanted = std::exchange(request.use, world.use);
  for (std::size_t i = 0; i < world.photos.size(); ++i)
    request.use[i] = request.use[i] && (wanted.empty() || wanted[static_cast<std::size_t>(world.photos[i])]);
  if (source >= 0) {
    const auto found = std::find(world.photos.begin(), world.photos.end(), source);
    if (found == world.photos.end()) throw UsageError("this photo is not among those around the picture's moment", "use --window-frames all");
    source = static_cast<int>(found - world.photos.begin());
  }
  return RenderMeasureMap(world.sources, ProxyTracer(world.proxy, world.sources.normalized_from_world), {}, request, measure, source);
}

MeasureMap RenderMeasureMap(const Sources& sources, const ProxyTracer& tracer, const VisibilityMaps& maps, const RenderRequest& request,
                            Measure measure, int source) {
  if (measure == Measure::kWeight && request.settings.similarity == Similarity::kFull)
    throw UsageError("--show weights maps the real-time weights", "the optimum's are seen by --show false-color");
  const VisibilityMaps* blocked = request.settings.visibility ? &maps : nullptr;  // in the weights, as when rendering
  const ViewSetup weighing = MakeViewSetup(sources, request.view, request.settings, request.use);
  ViewSetup shown = weighing;
  if (measure == Measure::kResolution && shown.settings.resolution == Resolution::kOff) shown.settings.resolution = Resolution::kJacobian;
  if (measure == Measure::kTime) shown.settings.time = true;
  shown.settings.field_of_view = true;
  const int width = request.view.size_px.x(), height = request.view.size_px.y();
  std::vector<float> values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), kNothing);
  ParallelFor(static_cast<std::size_t>(height), 4, [&](std::size_t begin, std::size_t end) {
    std::vector<Eigen::Vector3f> direction(static_cast<std::size_t>(width)), normal(direction.size());
    std::vector<float> t(direction.size()), everyone;
    WeighScratch scratch;
    Measures m;
    for (std::size_t y = begin; y < end; ++y) {
      if (InterruptRequested()) return;
      for (int x = 0; x < width; ++x)
        direction[static_cast<std::size_t>(x)] =
            (weighing.ray_from_pixel * Eigen::Vector3d(x + 0.5, static_cast<double>(y) + 0.5, 1)).normalized().cast<float>();
      tracer.Trace(weighing.desired.centre.cast<float>(), direction, t, normal);
      for (std::size_t x = 0; x < direction.size(); ++x) {
        if (!std::isfinite(t[x]) || !(t[x] > 0)) continue;
        int camera = source;
        float weight = 0;
        if (weighing.settings.k == 0) {
          if (!(WeighAll(weighing.sources, blocked, direction[x], t[x], weighing.settings, scratch, everyone, normal[x]) > 0)) continue;
          const auto best = source >= 0 ? everyone.begin() + source : std::max_element(everyone.begin(), everyone.end());
          camera = static_cast<int>(best - everyone.begin());
          weight = *best;
        } else {
          const RayWeights w = Weigh(weighing.sources, blocked, direction[x], t[x], weighing.settings, scratch, normal[x]);
          for (std::size_t i = 0; i < static_cast<std::size_t>(w.count); ++i)
            if (source >= 0 ? w.camera[i] == source : w.weight[i] > weight) {
              camera = w.camera[i];
              weight = w.weight[i];
            }
        }
        if (camera < 0) continue;
        EvaluateMeasures(shown.sources, shown.settings, direction[x], t[x], normal[x], m);
        EvaluateVisibility(shown.sources, &maps, direction[x], t[x], m);
        values[y * static_cast<std::size_t>(width) + x] = Value(measure, static_cast<std::size_t>(camera), shown, m, weight);
      }
    }
  });
  CheckInterrupted();

  MeasureMap map;
  map.unit = measure == Measure::kAngle || measure == Measure::kDissimilarity ? "deg" : measure == Measure::kTime ? "s" : "";
  map.high = 1;
  if (!map.unit.empty()) {
    // The farthest tenth would darken everything else.
    std::vector<float> seen;
    std::copy_if(values.begin(), values.end(), std::back_inserter(seen), [](float v) { return v >= 0 && std::isfinite(v); });
    if (!seen.empty()) {
      const auto at = static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(seen.size() - 1));
      std::nth_element(seen.begin(), seen.begin() + at, seen.end());
      map.high = std::max(static_cast<double>(seen[static_cast<std::size_t>(at)]), 1e-9);
    }
  }
  cv::Mat scale(1, 256, CV_8UC1), colors;
  for (int i = 0; i < 256; ++i) scale.at<std::uint8_t>(i) = static_cast<std::uint8_t>(i);
  cv::applyColorMap(scale, colors, cv::COLORMAP_VIRIDIS);
  map.image = ImageF(width, height, 4);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] >= 0)) continue;
    const auto c = colors.at<cv::Vec3b>(static_cast<int>(std::lround(255 * std::min(1.0, values[i] / map.high))));
    float* out = map.image.data.data() + 4 * i;
    for (int channel = 0; channel < 3; ++channel) out[channel] = static_cast<float>(c[2 - channel]) / 255.0F;
    out[3] = 1;
  }
  return map;
}

}  // namespace lumi
