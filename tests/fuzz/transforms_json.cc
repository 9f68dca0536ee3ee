// transforms.json beside photos of the seeds' names.
#include <cmath>

#include "scene/files/transforms_json.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/seeds.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(transforms_json) {
  static const bool photos_are_there = [] {
    for (const View& v : SeedScene().views) InputFile("transforms/images/" + v.name, "their sizes stand in the file");
    return true;
  }();
  static_cast<void>(photos_are_there);
  const Scene scene = ReadTransformsJson(InputFile("transforms/transforms.json", bytes));
  for (const Camera& c : scene.cameras) Require(!Validate(c), "a camera that is none was accepted");
  for (const View& v : scene.views) {
    Require(v.cam_from_world.translation.allFinite() && std::isfinite(v.time_s.value_or(0)), "a view's pose");
    Require(std::abs(v.cam_from_world.rotation.norm() - 1) < 1e-6, "a rotation is no unit quaternion");
  }
}

}  // namespace lumi::fuzz
