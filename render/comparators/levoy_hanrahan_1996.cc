// Levoy and Hanrahan, "Light Field Rendering", SIGGRAPH 1996: rays by two planes, that of the cameras and one through
// the scene, interpolated linearly in each. No geometry: what does not lie in the focal plane is doubled or blurred.
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "render/comparators/light_slab.h"
#include "render/comparators/methods.h"
#include "render/comparators/photo_rank.h"

namespace lumi {
namespace {

constexpr std::size_t kPhotosAsked = 16;  // about so many photos, whose median depths place the focal plane

class LevoyHanrahan final : public LightSlab {
 public:
  LevoyHanrahan(const CameraGrid& grid, double depth, const ViewSetup& setup)
      : LightSlab(grid, setup),
        normal_(grid.normal),
        distance_((grid.origin + depth * grid.normal - setup.desired.centre).dot(grid.normal)) {}

  void Meet(RaySamples& rays) const override {
    rays.exact_t.resize(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Eigen::Vector3d d =
          i < rays.exact_direction.size() ? rays.exact_direction[i] : rays.direction[i].cast<double>();
      const double t = distance_ / d.dot(normal_);
      rays.exact_t[i] = t > 0 && std::isfinite(t) ? t : 0;
      rays.t[i] = rays.exact_t[i] > 0 ? static_cast<float>(t) : std::numeric_limits<float>::infinity();
      if (i < rays.normal.size()) rays.normal[i] = -normal_.cast<float>();
      if (i < rays.face.size()) rays.face[i] = -1;
    }
  }

 private:
  Eigen::Vector3d normal_;
  double distance_;  // of the focal plane from the view, along the normal
};

}  // namespace

std::shared_ptr<const RayMethod> MakeLevoyHanrahan(const Sources& sources, const ProxyTracer& proxy,
                                                   const ViewSetup& setup) {
  const CameraGrid grid = FitCameraGrid(sources, setup.settings.method_count, Name(setup.settings.method));
  // The plane at the harmonic mean of the distances splits the disparities before and behind it evenly (Chai et al.
  // 2000); the paper puts it by hand.
  ViewSetup from_photo = setup;
  double inverse = 0;
  const std::size_t step = 1 + sources.views.size() / kPhotosAsked;
  int asked = 0;
  for (std::size_t j = 0; j < sources.views.size(); j += step, ++asked) {
    from_photo.desired = sources.views[j];
    const Eigen::Matrix3d m = sources.views[j].P.leftCols<3>();
    from_photo.ray_from_pixel = m.inverse();
    inverse += 1 / MedianDepth(from_photo, proxy);
  }
  const double depth = OrOwn(setup.settings.method_parameter, 1) * asked / inverse;
  return std::make_shared<LevoyHanrahan>(grid, depth, setup);
}

}  // namespace lumi
