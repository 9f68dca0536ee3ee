// Lhuillier and Quan, "Image Interpolation by Joint View Triangulation", Graphics Interface 1999: two photos next to
// the view, triangulated together, each triangle of which is warped from both and dissolved by the view's place
// between them. The triangulation is the proxy here.
#include "render/comparators/methods.h"
#include "render/comparators/photo_pair.h"
#include "scene/program/error.h"

namespace lumi {

std::shared_ptr<const RayMethod> MakeLhuillierQuan(const Sources& sources, const ProxyTracer& proxy,
                                                   const ViewSetup& setup) {
  const auto pair = PairAround(sources, setup, MedianDepth(setup, proxy), false);
  if (!pair) throw DataError("lhuillier-quan-1999 needs two photos at different places", "add photos");
  return std::make_shared<PairMethod>(*pair);
}

}  // namespace lumi
