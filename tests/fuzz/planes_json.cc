#include <cmath>

#include "proxy/planes/planes_json.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(planes_json) {
  const GivenPlanes given = ReadPlanesJson(InputFile("planes.json", bytes));
  for (const FittedPlane& p : given.planes)
    Require(std::abs(p.normal.norm() - 1) < 1e-6 && std::isfinite(p.offset), "a plane is none");
  if (!given.quads.faces.empty()) Require(!Validate(given.quads), "quads are no mesh");
}

}  // namespace lumi::fuzz
