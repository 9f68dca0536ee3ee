// Properties of a method's weights, measured at random rays: the numbers of those columns of the thesis's Table 3.1
// that need no picture (table_3_1.h). docs/methods.md says what each is.
#pragma once

#include <optional>

#include "render/tradeoff/ray_bench.h"

namespace lumi {

// A figure is none if no ray of the scene can show it (e.g. the proxy hides nothing, or no photos overlap).
struct RayFigures {
  std::optional<double> photos_used;  // share of the cameras that see the proxy, whose photo counts near its own camera
  std::optional<double> direction_error;  // of a colour that is the direction itself, over that of the mean of all
  std::optional<double> own_weight;       // of a photo at its own camera, lower 5 %
  std::optional<double> ray_difference;   // difference of a weight for one ray seen from two positions on it, upper 5 %
  std::optional<double> jump;             // change of a weight over a step of 1e-7 scene sizes, largest on 20 lines
  std::optional<double> border_weight;    // of a photo at its border, upper 5 %
  std::optional<double>
      coarse_weight_ratio;              // of a photo's weight, once it is four times as far on its own ray; median
  std::optional<double> hidden_weight;  // of photos from which the proxy hides the point; mean
};
// Measures the figures of these settings. Throws what the method throws, if it accepts no view of this scene at all.
RayFigures MeasureRays(const RayBench& bench, const RadianceSettings& settings);

}  // namespace lumi
