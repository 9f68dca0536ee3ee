// The named settings that `tradeoff` measures: a base point, lines along one option at a time, and a few crossings
// where two options pull the same way.
#pragma once

#include <string>
#include <vector>

#include "render/radiance/settings.h"

namespace lumi {

enum class Method { kPixel, kInterpolated, kCandidates, kOptimumGrid, kOptimumPixel };
std::string_view Name(Method method);  // "identity", "interpolated", "candidates", "optimum on the grid", "optimum"
Method MethodOf(const RadianceSettings& settings);

// `base` with the options that make the method; grid: samples a side.
RadianceSettings WithMethod(RadianceSettings base, Method method, int grid = 25);

// "candidates 25x25, k 4": the method and what differs from `base`.
std::string PointName(const RadianceSettings& settings, const RadianceSettings& base);

// Whether sparse samples have an effect: with all photos as candidates, every pixel weighs the same photos as without
// samples.
bool HasSamples(const RadianceSettings& settings);

// The same weights computed at every pixel: what a sparse point is measured against (Fig. 5-4).
RadianceSettings PerPixel(const RadianceSettings& settings);

// One measured setting; a table has no two equal ones. kMethods: the methods only (for a scene's further proxies);
// kQuick: also a few grids and k; kFull: everything.
struct SweepPoint {
  std::string name;
  RadianceSettings settings;
};
enum class SweepSize { kMethods, kQuick, kFull };
std::vector<SweepPoint> SweepTable(const RadianceSettings& base, SweepSize size);

}  // namespace lumi
