// What the parts of the factorisation hand to each other: image points in Hartley's normalised coordinates, and cameras
// and points up to one projective transformation.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "scene/geometry/projection.h"

namespace lumi {

// One image point of a track. x_normalised = (x_px - centre_px) / px_per_unit of its frame.
struct Sight {
  int frame = -1;
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
};

struct ImagePoints {
  std::vector<Eigen::Vector2d> centre_px;  // one a frame
  std::vector<double> px_per_unit;         // one a frame, > 0
  std::vector<std::vector<Sight>> tracks;  // frames ascending

  std::size_t FrameCount() const { return px_per_unit.size(); }
};

// x_normalised ~ P X. Scales of P and X are free, signs too until SolveQuasiAffine has fixed them.
struct ProjectiveModel {
  std::vector<Matrix34d> P;  // one a frame, norm 1 where placed
  std::vector<char> placed;
  std::vector<Eigen::Vector4d> X;  // one a track, norm 1 where solved
  std::vector<char> solved;
  std::vector<std::vector<char>> inlier;  // as ImagePoints::tracks

  ProjectiveModel() = default;
  explicit ProjectiveModel(const ImagePoints& points);
  int PlacedCount() const;
  int SolvedCount() const;
};

// Pixels between a sight and its prediction; infinity where the point lies on the camera's principal plane.
double ReprojectionErrorPx(const ImagePoints& points, const ProjectiveModel& model, const Sight& sight,
                           std::size_t track);

// Of the inlier sights of placed frames and solved tracks: their errors, in the order of tracks, and their root mean
// square.
std::vector<double> InlierErrorsPx(const ImagePoints& points, const ProjectiveModel& model);
double RmsPx(const ImagePoints& points, const ProjectiveModel& model);

// The model in another projective frame: P <- P H, X <- H^-1 X. H: 4x4, invertible.
void ChangeFrame(ProjectiveModel& model, const Eigen::Matrix4d& H);

// The projective frame in which the placed cameras, each of norm 1 and stacked, have orthonormal columns: what the
// factorisation's balanced solution has, and where points and cameras are far from the plane w = 0 on average only by
// what the data say. Linear and non-linear steps are well conditioned there.
void BalanceFrame(ProjectiveModel& model);

// [v]_x: CrossMatrix(v) * w = v x w.
Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v);

}  // namespace lumi
