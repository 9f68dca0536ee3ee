// Pairs of points that place a mesh: JSON or lines of six numbers.
#include "proxy/import/placement.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(point_pairs) {
  const bool json = !bytes.empty() && bytes.front() == '{';
  const std::vector<PointPair> pairs = ReadPointPairs(InputFile(json ? "pairs.json" : "pairs.csv", bytes));
  for (const PointPair& p : pairs) Require(p.mesh.allFinite() && p.scene.allFinite(), "a point is not finite");
}

}  // namespace lumi::fuzz
