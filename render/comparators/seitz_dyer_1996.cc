// Seitz and Dyer, "View Morphing", SIGGRAPH 1996: two photos are rectified, their corresponding pixels moved and
// dissolved linearly, and the result is turned to the view. Over a known surface that is the dissolve of the two, for
// two photos that can be rectified; other cameras are refused.
#include "render/comparators/methods.h"
#include "render/comparators/photo_pair.h"
#include "scene/program/error.h"

namespace lumi {

std::shared_ptr<const RayMethod> MakeSeitzDyer(const Sources& sources, const ProxyTracer& proxy,
                                               const ViewSetup& setup) {
  const auto pair = PairAround(sources, setup, MedianDepth(setup, proxy), true);
  if (!pair)
    throw DataError(
        "seitz-dyer-1996 needs two photos beside the view neither of which has the other's camera in its frame",
        "lhuillier-quan-1999 interpolates any two");
  return std::make_shared<PairMethod>(*pair);
}

}  // namespace lumi
