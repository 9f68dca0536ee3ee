// Wood, Azuma, Aldinger, Curless, Duchamp, Salesin and Stuetzle, "Surface Light Fields for 3D Photography", SIGGRAPH
// 2000: for each point of a surface that is known exactly a lumisphere, the colour that leaves it in each direction,
// piecewise linear over a subdivided octahedron and as smooth as the photos allow (pointwise fairing). This is a
// stand-in: each pixel's lumisphere is fitted when needed and not compressed. Directions are the view's, not mirrored
// at the normal, because a rough proxy's normals would scatter mirrored ones.
#include <algorithm>
#include <cmath>

#include "render/comparators/methods.h"
#include "render/comparators/point_method.h"
#include "render/comparators/sphere_grid.h"

namespace lumi {
namespace {

// Cholesky factor of a symmetric matrix (row-major), written into its lower half; false if it is not positive definite.
bool Cholesky(std::vector<double>& a, std::size_t n) {
  for (std::size_t j = 0; j < n; ++j) {
    double d = a[j * n + j];
    for (std::size_t k = 0; k < j; ++k) d -= a[j * n + k] * a[j * n + k];
    if (!(d > 0)) return false;
    const double root = std::sqrt(d);
    a[j * n + j] = root;
    for (std::size_t i = j + 1; i < n; ++i) {
      double s = a[i * n + j];
      for (std::size_t k = 0; k < j; ++k) s -= a[i * n + k] * a[j * n + k];
      a[i * n + j] = s / root;
    }
  }
  return true;
}

void SolveCholesky(const std::vector<double>& l, std::size_t n, std::vector<double>& x) {
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < i; ++k) x[i] -= l[i * n + k] * x[k];
    x[i] /= l[i * n + i];
  }
  for (std::size_t i = n; i-- > 0;) {
    for (std::size_t k = i + 1; k < n; ++k) x[i] -= l[k * n + i] * x[k];
    x[i] /= l[i * n + i];
  }
}

class Wood final : public PointMethod {
 public:
  explicit Wood(const RadianceSettings& s) : grid_(static_cast<int>(std::clamp(OrOwn(s.method_count, 2), 1.0, 8.0))) {
    const double fairness = OrOwn(s.method_parameter, 0.1);
    const std::size_t n = grid_.size();
    fairing_.assign(n * n, 0.0);
    for (const auto& [a, b] : grid_.edges()) {
      const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
      fairing_[i * n + i] += fairness;
      fairing_[j * n + j] += fairness;
      fairing_[i * n + j] -= fairness;
      fairing_[j * n + i] -= fairness;
    }
    // Keeps the system solvable for a direction that no photo covers and that has no fairing to its neighbours.
    for (std::size_t i = 0; i < n; ++i) fairing_[i * n + i] += kNugget;
  }

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo&, WeightedPhotos& out) const override {
    const std::size_t n = grid_.size();
    thread_local std::vector<double> a, x;
    a = fairing_;
    x.assign(n, 0.0);
    const Eigen::Vector3d p = point.point();
    thread_local std::vector<std::array<std::pair<std::int32_t, double>, 3>> bases;
    bases.clear();
    for (const std::int32_t j : point.seeing) {
      const double g = point.f[static_cast<std::size_t>(j)];
      bases.push_back(grid_.Around(CentreOf(point.setup, j) - p));
      for (const auto& [r, wr] : bases.back())
        for (const auto& [c, wc] : bases.back())
          a[static_cast<std::size_t>(r) * n + static_cast<std::size_t>(c)] += g * wr * wc;
    }
    for (const auto& [node, weight] : grid_.Around(-p)) x[static_cast<std::size_t>(node)] += weight;
    if (!Cholesky(a, n)) return;
    SolveCholesky(a, n, x);
    for (std::size_t i = 0; i < bases.size(); ++i) {
      double w = 0;
      for (const auto& [node, weight] : bases[i]) w += weight * x[static_cast<std::size_t>(node)];
      out.camera.push_back(point.seeing[i]);
      out.weight.push_back(
          static_cast<float>(w * static_cast<double>(point.f[static_cast<std::size_t>(point.seeing[i])])));
    }
  }

 private:
  static constexpr double kNugget = 1e-9;
  SphereGrid grid_;
  std::vector<double> fairing_;
};

}  // namespace

std::shared_ptr<const RayMethod> MakeWood(const Sources&, const ProxyTracer&, const ViewSetup& setup) {
  return std::make_shared<Wood>(setup.settings);
}

}  // namespace lumi
