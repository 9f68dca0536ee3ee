#include "scene/files/projective_json.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(projective_json) {
  const Scene scene = ReadProjectiveJson(InputFile("projective.json", bytes));
  for (const View& v : scene.views) Require(v.P.allFinite() && v.size_px.minCoeff() > 0, "a view is none");
  for (const Point& p : scene.points)
    for (const Observation& o : p.track)
      Require(static_cast<std::size_t>(o.view.value) < scene.views.size() && o.x_px.allFinite(),
              "an observation leads nowhere");
}

}  // namespace lumi::fuzz
