// What the tests of the simulator share: a scene from JSON, ready to be rendered.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "simulate/view_renderer.h"

namespace lumi {

struct SmallScene {
  SceneDescription description;
  Tracer tracer;
  Shader shader;
  ViewRenderer renderer;
  std::vector<PlannedView> views;

  explicit SmallScene(const std::string& json, int width_px = 0, std::uint64_t seed = 0)
      : description(ParseScene(json, "test.json", ".")),
        tracer(description),
        shader(description, tracer),
        renderer(description, tracer, shader, width_px, seed),
        views(PlanViews(description, 0)) {}
  SmallScene(const SmallScene&) = delete;
  SmallScene& operator=(const SmallScene&) = delete;

  RenderedView Render(std::size_t view = 0, TraceCounters* counters = nullptr) const {
    TraceCounters unused;
    return renderer.Render(views[view], counters == nullptr ? unused : *counters);
  }
  // Unit ray, world, through a pixel of a view's true camera.
  Ray RayThrough(std::size_t view, const Eigen::Vector2d& x_px) const {
    const TrueCamera truth = renderer.CameraOf(views[view]);
    const auto x = NormalizedWithSkew(truth.camera, truth.skew_px, x_px);
    return {truth.cam_from_world.OriginInSource(),
            (truth.cam_from_world.rotation.conjugate() * x->homogeneous()).normalized()};
  }
};

}  // namespace lumi
