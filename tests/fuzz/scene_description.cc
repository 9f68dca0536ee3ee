// lumi-simulate's scene, up to the views that it plans.
#include "simulate/scene_description.h"
#include "simulate/camera_paths.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(scene_description) {
  const SceneDescription scene = ParseScene(std::string(bytes), "scene.json", InputFolder());
  Require(!scene.cameras.empty() && !scene.paths.empty(), "a scene without a camera or a path");
  for (const CameraDescription& c : scene.cameras) Require(!Validate(c.camera), "a camera that is none");
  static_cast<void>(EffectsOn(scene));
  const std::vector<PlannedView> views = PlanViews(scene, 0);
  Require(!views.empty(), "a path without a view");
  for (const PlannedView& v : views)
    Require(static_cast<std::size_t>(v.camera) < scene.cameras.size(), "a view has no camera");
}

}  // namespace lumi::fuzz
