// A measure of the reconstruction as a picture: what each ray of a view makes of one photo, or of the photo that weighs
// most.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/radiance/proxy_tracer.h"
#include "render/radiance/sources.h"
#include "render/radiance/visibility.h"
#include "render/world/per_view_proxy.h"
#include "render/world/renderer.h"

namespace lumi {

// What --show calls a heat map: weights, the measures that have one, dissimilarity.
struct HeatMap {
  std::string_view name, help, unit;  // deg, s, or empty
};
const std::vector<HeatMap>& HeatMaps();

// One of them, by its place.
struct Measure {
  std::size_t row = 0;  // the weights
  bool operator==(const Measure&) const = default;
};
std::optional<Measure> MeasureFromName(std::string_view name);

struct MeasureMap {
  ImageF image;               // RGBA in [0,1], premultiplied; transparent where the proxy is missed
  std::vector<float> values;  // one a pixel, row by row, not clipped; NaN where there is none
  double low = 0, high = 0;   // the values of the colour scale's ends
  std::string unit;           // deg, s, or empty
};

// `source`: the photo that is shown; -1: at each ray the one with the largest weight. Values beyond `high` are clipped.
// Identity weights; measures that the settings leave off are shown all the same.
MeasureMap RenderMeasureMap(const Sources& sources, const ProxyTracer& proxy, const VisibilityMaps& visibility,
                            const RenderRequest& request, Measure measure, int source);
// Of a picture in its own world: request.view is not read, request.use and `source` are of the scene's views. Throws
// UsageError for a photo that the picture is not made of.
MeasureMap RenderMeasureMap(const PictureWorld& world, RenderRequest request, Measure measure, int source);
MeasureMap RenderMeasureMap(const Scene& scene, const Mesh& proxy, const RenderRequest& request, Measure measure,
                            int source);

}  // namespace lumi
