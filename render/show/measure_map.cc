#include "render/show/measure_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "render/radiance/dissimilarity.h"
#include "render/radiance/frame_plan.h"
#include "render/world/visibility_maps.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr float kNothing = -1;  // no value: the proxy is missed, or no photo sees the point
constexpr std::string_view kWeights = "weights", kDissimilarity = "dissimilarity";

template <typename M>
float ValueOf(std::size_t j, const RadianceSettings& s, const Measures& m) {
  if constexpr (Term<M>)
    return static_cast<float>(M::Shown(static_cast<double>(m.Of<M>()[j]), s));
  else if constexpr (std::is_same_v<M, measure::Angle>)
    return m.theta[j] / static_cast<float>(kRadPerDeg);
  else if constexpr (std::is_same_v<M, measure::FieldOfView>)
    return m.f[j];
  else
    return m.v[j];
}

float Value(std::string_view name, std::size_t j, const RadianceSettings& s, const Measures& m, float weight) {
  if (name == kWeights) return weight;
  float value = kNothing;
  MeasureList::ForEach([&]<typename M> {
    if constexpr (Mapped<M>)
      if (M::kName == name) value = ValueOf<M>(j, s, m);
  });
  if (name != kDissimilarity || !(m.f[j] > 0)) return value;
  const float g = static_cast<float>(s.alpha) * m.theta[j] + (m.terms.empty() ? 0.0F : m.terms[j]);
  return Dissimilarity(g, m.f[j] * (s.visibility ? m.v[j] : 1.0F), static_cast<float>(s.gamma)) /
         static_cast<float>(kRadPerDeg);
}

}  // namespace

const std::vector<HeatMap>& HeatMaps() {
  static const std::vector<HeatMap> maps = [] {
    std::vector<HeatMap> list{{kWeights, "The weight of the photo that weighs most", ""}};
    MeasureList::ForEach([&]<typename M> {
      if constexpr (Mapped<M>) list.push_back({M::kName, M::kHeatMapHelp, M::kHeatMapUnit});
    });
    list.push_back({kDissimilarity, "All measures together, as they are weighed", "deg"});
    return list;
  }();
  return maps;
}

std::optional<Measure> MeasureFromName(std::string_view name) {
  for (std::size_t row = 0; row < HeatMaps().size(); ++row)
    if (HeatMaps()[row].name == name) return Measure{row};
  return std::nullopt;
}

MeasureMap RenderMeasureMap(const Scene& scene, const Mesh& proxy, const RenderRequest& request, Measure measure,
                            int source) {
  const TracedProxy traced(scene, proxy);
  return RenderMeasureMap(traced.sources, traced.tracer, traced.maps, request, measure, source);
}

MeasureMap RenderMeasureMap(const PictureWorld& world, RenderRequest request, Measure measure, int source) {
  request.view = world.view;
  const std::vector<bool> wanted = std::exchange(request.use, world.use);
  for (std::size_t i = 0; i < world.photos.size(); ++i)
    request.use[i] = request.use[i] && (wanted.empty() || wanted[static_cast<std::size_t>(world.photos[i])]);
  if (source >= 0) {
    const auto found = std::find(world.photos.begin(), world.photos.end(), source);
    if (found == world.photos.end())
      throw UsageError("this photo is not among those around the picture's moment", "use --window-frames all");
    source = static_cast<int>(found - world.photos.begin());
  }
  return RenderMeasureMap(world.sources, ProxyTracer(world.proxy, world.sources.normalized_from_world), {}, request,
                          measure, source);
}

MeasureMap RenderMeasureMap(const Sources& sources, const ProxyTracer& tracer, const VisibilityMaps& maps,
                            const RenderRequest& request, Measure measure, int source) {
  if (HeatMaps()[measure.row].name == kWeights && request.settings.similarity == Similarity::kFull)
    throw UsageError("--show weights maps the real-time weights", "the optimum's are seen by --show false-color");
  const VisibilityMaps* blocked = request.settings.visibility ? &maps : nullptr;  // for the weights, as in rendering
  const ViewSetup weighing = MakeViewSetup(sources, request.view, request.settings, request.use);
  ViewSetup shown = weighing;
  const HeatMap& kind = HeatMaps()[measure.row];
  ForEachTerm([&]<typename M> {
    if (M::kName == kind.name) M::ShowAll(shown.settings);
  });
  shown.settings.field_of_view = true;
  const int width = request.view.size_px.x(), height = request.view.size_px.y();
  std::vector<float> values(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), kNothing);
  ParallelFor(static_cast<std::size_t>(height), 4, [&](std::size_t begin, std::size_t end) {
    std::vector<Eigen::Vector3f> direction(static_cast<std::size_t>(width)), normal(direction.size());
    std::vector<float> t(direction.size());
    WeightedPhotos row;
    WeighScratch scratch;
    Measures m;
    for (std::size_t y = begin; y < end; ++y) {
      if (InterruptRequested()) return;
      for (int x = 0; x < width; ++x)
        direction[static_cast<std::size_t>(x)] =
            (weighing.ray_from_pixel * Eigen::Vector3d(x + 0.5, static_cast<double>(y) + 0.5, 1))
                .normalized()
                .cast<float>();
      tracer.Trace(weighing.desired.centre.cast<float>(), direction, t, normal);
      for (std::size_t x = 0; x < direction.size(); ++x) {
        if (!std::isfinite(t[x]) || !(t[x] > 0)) continue;
        row.camera.clear();
        row.weight.clear();
        const float alpha =
            WeighRay({weighing.sources, blocked, weighing.settings}, {direction[x], t[x], normal[x]}, scratch, row);
        if (!(alpha > 0)) continue;
        int camera = source;
        float weight = 0;
        for (std::size_t i = 0; i < row.camera.size(); ++i)
          if (source >= 0 ? row.camera[i] == source : row.weight[i] > weight) {
            camera = row.camera[i];
            weight = row.weight[i];
          }
        if (camera < 0) continue;
        EvaluateMeasures(shown.sources, shown.settings, direction[x], t[x], normal[x], m);
        EvaluateVisibility(shown.sources, &maps, direction[x], t[x], m);
        values[y * static_cast<std::size_t>(width) + x] =
            Value(kind.name, static_cast<std::size_t>(camera), shown.settings, m, weight);
      }
    }
  });
  CheckInterrupted();

  MeasureMap map;
  map.unit = kind.unit;
  map.high = 1;
  if (!map.unit.empty()) {
    // The farthest tenth would darken everything else.
    std::vector<float> seen;
    std::copy_if(values.begin(), values.end(), std::back_inserter(seen),
                 [](float v) { return v >= 0 && std::isfinite(v); });
    if (!seen.empty()) map.high = std::max(static_cast<double>(Quantile(seen, 0.9)), 1e-9);
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
  std::ranges::replace(values, kNothing, std::numeric_limits<float>::quiet_NaN());
  map.values = std::move(values);
  return map;
}

}  // namespace lumi
