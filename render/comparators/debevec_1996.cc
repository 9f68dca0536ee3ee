// Debevec, Taylor and Malik, "Modeling and Rendering Architecture from Photographs", SIGGRAPH 1996: view-dependent
// texture mapping. At each pixel the photos that see the model's point are averaged, each by the inverse of the angle
// between its ray and the view's, and less towards its border.
#include <algorithm>
#include <cmath>

#include "render/comparators/methods.h"
#include "render/comparators/point_method.h"

namespace lumi {
namespace {

constexpr double kSmallestAngle = 1e-9;  // rad: nearer than this the photo's own colour is what is seen

class Debevec1996 final : public PointMethod {
 public:
  explicit Debevec1996(const RadianceSettings& s)
      : photos_(static_cast<std::size_t>(std::max(0.0, OrOwn(s.method_count, 0)))),
        power_(OrOwn(s.method_parameter, 1)) {}

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo&, WeightedPhotos& out) const override {
    out.camera = point.seeing;
    const auto angle = [&](std::int32_t j) { return point.theta[static_cast<std::size_t>(j)]; };
    if (photos_ > 0 && photos_ < out.camera.size()) {
      std::ranges::nth_element(out.camera, out.camera.begin() + static_cast<std::ptrdiff_t>(photos_ - 1), {}, angle);
      out.camera.resize(photos_);
    }
    for (const std::int32_t j : out.camera)
      out.weight.push_back(static_cast<float>(static_cast<double>(point.f[static_cast<std::size_t>(j)]) *
                                              std::pow(std::max<double>(angle(j), kSmallestAngle), -power_)));
  }

 private:
  std::size_t photos_;  // 0: all
  double power_;
};

}  // namespace

std::shared_ptr<const RayMethod> MakeDebevec1996(const Sources&, const ProxyTracer&, const ViewSetup& setup) {
  return std::make_shared<Debevec1996>(setup.settings);
}

}  // namespace lumi
