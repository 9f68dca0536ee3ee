// Gortler, Grzeszczuk, Szeliski and Cohen, "The Lumigraph", SIGGRAPH 1996: the light field's two planes, with the
// second one's coordinates corrected by the depth of a rough surface, and photos from anywhere brought to the grid by
// push-pull.
#include "render/comparators/light_slab.h"
#include "render/comparators/methods.h"

namespace lumi {

std::shared_ptr<const RayMethod> MakeGortler(const Sources& sources, const ProxyTracer&, const ViewSetup& setup) {
  return std::make_shared<LightSlab>(FitCameraGrid(sources, setup.settings.method_count, Name(setup.settings.method)),
                                     setup);
}

}  // namespace lumi
