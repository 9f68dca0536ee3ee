// Cameras about something on a turntable, in the room and in its own frame.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "reconstruct/turntable.h"

namespace lumi {

// A camera in the room that looks at an object on a table, and rises after every turn; `shake`: of a hand, in the
// room's units and radians.
struct Table {
  Eigen::Vector3d axis = Eigen::Vector3d(0.1, -1, 0.2).normalized(), point{0.3, 0.2, -0.1};
  std::vector<Rigid3> cam_from_room, cam_from_object;
  std::vector<double> turns;

  Table(int photos, double step, double first, double shake) {
    std::mt19937 random(11);
    std::normal_distribution<double> noise(0, 1);
    TurnAxis truth{.direction = axis, .point = point};
    for (int i = 0; i < photos; ++i) {
      turns.push_back(first + i * step);
      const double rise = std::floor(i * step) * 0.2;
      const Eigen::Vector3d eye =
          Eigen::Vector3d(2, -0.4 - rise, 1) + shake * Eigen::Vector3d(noise(random), noise(random), noise(random));
      Rigid3 camera = LookAt(eye, point, -axis);
      camera = Rigid3{Eigen::Quaterniond(Eigen::AngleAxisd(
                          shake * noise(random), Eigen::Vector3d(noise(random), 1, noise(random)).normalized())),
                      Eigen::Vector3d::Zero()} *
               camera;
      cam_from_room.push_back(camera);
      cam_from_object.push_back(camera * truth.RoomFromObject(turns.back()));
    }
  }
  double DistanceOff(const TurnAxis& found) const { return axis.cross(found.point - point).norm(); }
};

}  // namespace lumi
