// lumigraph.json, beside a COLMAP model as it should be; and as a provenance that a stage left (the pipeline reads all
// of a scene's).
#include <cmath>

#include "scene/files/colmap_model.h"
#include "scene/files/scene_folder.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/seeds.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(manifest) {
  static const bool model_is_there = (WriteColmapModel(SeedScene(), InputFolder() / "scene/sparse"), true);
  static_cast<void>(model_is_there);
  InputFile("scene/lumigraph.json", bytes);
  OpenOptions options;
  options.check_photos = false;
  options.undistort = false;
  const Scene scene = OpenScene(InputFolder() / "scene", options, SilentProgress());
  Require(std::abs(scene.up.norm() - 1) < 1e-6, "up is no unit vector");
  const Similarity3& n = scene.normalized_from_world;
  Require(n.scale > 0 && std::isfinite(n.scale) && n.translation.allFinite() && std::abs(n.rotation.norm() - 1) < 1e-6,
          "the normalisation is no similarity");
  for (const View& v : scene.views)
    Require(v.gain > 0 && std::isfinite(v.gain) && std::isfinite(v.time_s.value_or(0)), "a view's gain or time");
  Require(scene.period_s.value_or(1) > 0, "the period is not positive");
  Require(scene.metres_per_unit.value_or(1) > 0, "the scale is not positive");
}

}  // namespace lumi::fuzz
