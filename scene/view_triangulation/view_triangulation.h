// The proxy of one virtual view (thesis sec. 6.2.3): structure points projected into the view, triangulated in its
// image, and the triangles given back to the points. Exact at the points in any frame, since incidence is all that a
// projective frame keeps.
//
// Depth is generalised: kappa = pi . X / w, with x ~ P X = w (u, v, 1) and pi a plane that does not hold the camera's
// centre. The points of a plane of P^3 have a kappa that is affine in (u, v), so that triangles with a kappa at each
// corner are planes, and what is extended over the image is extended in kappa. With pi the plane at infinity kappa is
// the inverse depth up to scale.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "scene/geometry/mesh.h"
#include "scene/geometry/projection.h"
#include "scene/model/scene.h"

namespace lumi {

struct ViewTriangulationOptions {
  double margin =
      0.25;  // triangulated beyond the image on each side, of its longer side: what is just outside still counts
  int border_samples = 16;    // along the longer side of what is triangulated, >= 1: where depth is extended to
  int extension_points = 12;  // the nearest points that a border sample's depth is extended from, >= 1
  double merge_px = 6;  // of points whose images are nearer than about this one stays: the nearest to the camera where
                        // the plane at infinity is known, else the first
  double outlier_spread = 0.1;  // a point none of whose neighbours in the image lies within this share of the range of
                                // kappa (its 10 % to its 90 % quantile) is left out; infinity: none is
};
// Empty, or what is wrong.
const char* Validate(const ViewTriangulationOptions& options);

struct ViewTriangulation {
  // A corner: P vertices[i] = (x_px[i], 1), w > 0. Homogeneous, in world.
  std::vector<Eigen::Vector4d> vertices;
  std::vector<Eigen::Vector2d> x_px;  // in the image or the margin around it
  std::vector<double> kappa;
  std::vector<std::int32_t> point;                     // of the input, or -1: on the border
  std::vector<std::array<std::int32_t, 3>> triangles;  // tile the image and its margin; fronts towards the camera
  std::size_t used = 0;                                // points
  std::size_t behind = 0, outside = 0, merged = 0,
              outliers = 0;  // points left out: behind the camera (or not finite), beyond the margin ...
};

// X: homogeneous, in world, w > 0 in front of the camera; more reliable ones first. plane_at_infinity: where it is
// known or estimated. Without a point in view there are no triangles; with one or two, or collinear ones, there are, as
// far as depth can be extended from those. Throws std::invalid_argument for options that are wrong and for a P without
// rank 3.
ViewTriangulation TriangulateView(const Matrix34d& P, const Eigen::Vector2i& size_px,
                                  std::span<const Eigen::Vector4d> X, const std::optional<Plane>& plane_at_infinity,
                                  const ViewTriangulationOptions& options = {});

// The plane through a triangle, of unit length, positive at the camera's centre C (homogeneous, CentreOfProjection):
// the plane of a homography between two views (PlaneHomography). Zero where the triangle is seen from its edge.
Plane PlaneOfTriangle(const ViewTriangulation& triangulation, std::size_t triangle, const Eigen::Vector4d& C);

// For a metric or quasi-affine frame, whose points are finite: the same as a mesh, without the triangles that have a
// vertex at infinity or beyond it.
Mesh MeshOf(const ViewTriangulation& triangulation);

// Points of a scene of any frame that can be trusted, homogeneous, those of the longest tracks first: finite, a
// reprojection error of at most 4 px, at least three views (two where fewer than 500 points remain) and, where the
// frame is metric, rays that meet at 1.5 degrees or more.
std::vector<Eigen::Vector4d> StructurePoints(const Scene& scene);
// The same as indices into scene.points.
std::vector<std::int32_t> TrustedPoints(const Scene& scene);
Eigen::Vector4d Homogeneous(const Scene& scene, const Point& point);
// The plane at infinity of a scene: (0, 0, 0, 1) in metric frames and quasi-affine ones that say nothing else; none
// where unknown.
std::optional<Plane> PlaneAtInfinity(const Scene& scene);

}  // namespace lumi
