// A viewer's camera, for tests.
#pragma once

#include "render/viewer/navigation.h"

namespace lumi::test {

inline ViewState StateAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  ViewState s;
  s.cam_from_world = lumi::LookAt(eye, target, Eigen::Vector3d::UnitZ());
  return s;
}

}  // namespace lumi::test
