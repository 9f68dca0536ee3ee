#include "render/comparators/sphere_grid.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace lumi {

SphereGrid::SphereGrid(int parts) : parts_(std::max(1, parts)) {
  const int side = 2 * parts_ + 1;
  index_.assign(static_cast<std::size_t>(2 * side * side), -1);
  std::vector<Eigen::Vector3i> nodes;
  for (int x = -parts_; x <= parts_; ++x)
    for (int y = -(parts_ - std::abs(x)); y <= parts_ - std::abs(x); ++y) {
      const int z = parts_ - std::abs(x) - std::abs(y);
      for (const int s : {z, -z}) {
        if (s == 0 && z == 0 && !nodes.empty() && nodes.back() == Eigen::Vector3i(x, y, 0)) continue;
        index_[static_cast<std::size_t>(((x + parts_) * side + y + parts_) * 2 + (s < 0 ? 1 : 0))] =
            static_cast<std::int32_t>(nodes.size());
        nodes.emplace_back(x, y, s);
      }
    }
  for (const Eigen::Vector3i& n : nodes) directions_.push_back(n.cast<double>().normalized());
  // Neighbours differ by one step along two axes.
  for (std::size_t a = 0; a < nodes.size(); ++a)
    for (std::size_t b = a + 1; b < nodes.size(); ++b)
      if (const Eigen::Vector3i d = (nodes[a] - nodes[b]).cwiseAbs();
          d.maxCoeff() == 1 && d.sum() == 2 && (nodes[a] + nodes[b]).cwiseAbs().sum() >= 2 * parts_ - 1)
        edges_.emplace_back(static_cast<std::int32_t>(a), static_cast<std::int32_t>(b));
}

std::int32_t SphereGrid::NodeAt(const Eigen::Vector3i& n) const {
  const int side = 2 * parts_ + 1;
  return index_[static_cast<std::size_t>(((n.x() + parts_) * side + n.y() + parts_) * 2 + (n.z() < 0 ? 1 : 0))];
}

std::array<std::pair<std::int32_t, double>, 3> SphereGrid::Around(const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d a = direction.cwiseAbs();
  const Eigen::Vector3i sign = (direction.array() < 0).select(Eigen::Vector3i::Constant(-1), Eigen::Vector3i::Ones());
  // Barycentric over the octant's face, in steps of the lattice: x + y + z = parts.
  const Eigen::Vector3d q = a * (parts_ / a.sum());
  const int i = std::clamp(static_cast<int>(q.x()), 0, parts_ - 1),
            j = std::clamp(static_cast<int>(q.y()), 0, parts_ - 1 - i);
  const double x = q.x() - i, y = q.y() - j;
  const auto node = [&](int u, int v) { return NodeAt(sign.cwiseProduct(Eigen::Vector3i(u, v, parts_ - u - v))); };
  // The cell's square in (x, y) is two triangles; at the octant's far side the outer one does not exist.
  if (x + y <= 1 || i + j + 2 > parts_) {
    const double w = std::max(0.0, 1 - x - y);
    const double sum = w + x + y;
    return {{{node(i, j), w / sum}, {node(i + 1, j), x / sum}, {node(i, j + 1), y / sum}}};
  }
  return {{{node(i + 1, j + 1), x + y - 1}, {node(i + 1, j), 1 - y}, {node(i, j + 1), 1 - x}}};
}

}  // namespace lumi
