// Random cameras and points for tests; seeds come from the test, so that a failure repeats.
#pragma once

#include <random>

#include "scene/geometry/rigid3.h"
#include "scene/model/camera.h"

namespace lumi::test {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double Uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(engine_); }
  Eigen::Vector3d Direction() {
    std::normal_distribution<double> n;
    return Eigen::Vector3d(n(engine_), n(engine_), n(engine_)).normalized();
  }
  Eigen::Vector3d InBox(double half) { return {Uniform(-half, half), Uniform(-half, half), Uniform(-half, half)}; }
  Eigen::Quaterniond Rotation() { return Eigen::Quaterniond(Eigen::AngleAxisd(Uniform(0, 3.1), Direction())); }
  // Outside the unit box, looking at its middle.
  Rigid3 PoseAroundBox() { return LookAt(Uniform(3, 6) * Direction(), InBox(0.3), Direction()); }

 private:
  std::mt19937 engine_;
};

inline Camera TestCamera() { return Camera::Pinhole(640, 480, 520, 530, 318.5, 241.25); }

}  // namespace lumi::test
