// Something on a turntable, its cameras known in its own frame (that is what calibrations of turntables give): put into
// the frame of the room, in which it turns once a period and the camera stands, or moves as it did. That is the scene
// that repeats itself of the thesis's section 7.2; in the object's frame nothing moves and there is no time to speak
// of.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "scene/geometry/rigid3.h"
#include "scene/model/scene.h"

namespace lumi {

struct TurnAxis {
  Eigen::Vector3d direction =
      Eigen::Vector3d::UnitZ();                     // unit; the object turns about it by the right hand as time goes on
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  // on it
  double object_step = 0, room_step = 0;  // how far the camera goes from a photo to the next, medians, in either frame

  Rigid3 RoomFromObject(double turns) const;
};

// The axis about which, with the object turning by `turns` (one for each camera, in the order of time), the camera
// moves least in the room from each photo to the next; photos less than half a turn apart tell, and a few between which
// the camera was moved do no harm. Throws DataError: too few such pairs, or cameras that do not go round at the pace of
// the turns.
TurnAxis FindTurnAxis(const std::vector<Rigid3>& cam_from_object, const std::vector<double>& turns);

// Cameras and points of `scene` (metric, every view with a time) from the object's frame to the room's, which agree at
// phase 0. A point of the object becomes one for each moment at which photos saw it, where it then was. Sets the
// period.
TurnAxis PutIntoRoom(Scene& scene, double period_s);

}  // namespace lumi
