// A rectangular tube around the cameras' path: the proxy of a hallway (thesis sec. 5.3.3), four to six faces.
//
// Its axis is the direction in which the cameras travel or look. Walls are where the points are: the frame (three
// angles) and the four walls' distances are fitted together, each point to the wall that it lies near; points that lie
// near none, a table or a passer-by, are left out by their distance.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "proxy/points.h"
#include "scene/geometry/mesh.h"

namespace lumi {

struct BoxOptions {
  PointSelectionOptions points;
  int sides = 6;               // 6: closed; 5: open behind the cameras; 4: open at both ends
  double tolerance = 0.05;     // of the tube's half width: a point this near to a wall is on it
  double end_quantile = 0.98;  // the front end stands behind this share of the walls' points
  double margin = 0.05;        // of the tube's length and width: the least room between a camera and a wall
};
std::string Validate(const BoxOptions& options);  // empty, or what is wrong

struct BoxSummary {
  Eigen::Matrix3d box_from_world = Eigen::Matrix3d::Identity();                   // rows: right, down, along
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();  // in the box's frame
  std::array<std::size_t, 4> wall_points{};  // on the left, right, upper and lower wall
  std::array<double, 4> wall_rms{};          // their distance from it, in world units
  std::size_t points = 0, points_on_walls = 0;
};

// Front faces look inwards; all cameras are inside. Walls without points stand where the farthest points end. Throws
// DataError with fewer than 12 reliable points, or where all cameras are in one place and look in all directions (no
// axis).
Mesh BuildBoxProxy(const Scene& scene, const BoxOptions& options, BoxSummary* summary = nullptr);

}  // namespace lumi
