// The sparse points of a capture: random places on its surfaces with their exact images in the views that see them, as
// an ideal structure-from-motion would give.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/model/scene.h"
#include "scene/program/progress.h"
#include "simulate/view_renderer.h"

namespace lumi {

// A track as long as this says all there is to say; longer ones only make the model larger.
constexpr int kMaxTrackLength = 32;

// What is photographed, and by what.
struct TracedScene {
  const SceneDescription& scene;
  const Tracer& tracer;
  const Shader& shader;
  const ViewRenderer& renderer;
};

// Up to `count` points that at least two views see (fewer where there is little to see), drawn evenly over the photos'
// pixels. Moving parts have none. ViewIds are positions in `views`. `rays` grows by what was traced.
std::vector<Point> SampleSurfacePoints(const TracedScene& traced, const std::vector<PlannedView>& views, int count,
                                       std::uint64_t seed, ProgressSink& progress, long& rays);

}  // namespace lumi
