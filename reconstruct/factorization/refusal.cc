#include "reconstruct/factorization/refusal.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/factorization/normalise.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

constexpr double kStillPx = 0.75;  // at the photo's corners
// Share of the movement that a rotation may leave unexplained; movements of a few pixels are mostly noise.
constexpr double kUnexplained = 0.15;
constexpr double kNoiseMovementPx = 10;

}  // namespace

std::string_view Name(FactorizationRefusal refusal) {
  switch (refusal) {
    case FactorizationRefusal::kTooFewTracks: return "too few tracks";
    case FactorizationRefusal::kNoMotion: return "no motion";
    case FactorizationRefusal::kPureRotation: return "pure rotation";
    case FactorizationRefusal::kPlanarScene: return "planar scene";
  }
  return "";
}

FactorizationRefused::FactorizationRefused(FactorizationRefusal why, const std::string& detail, const std::string& hint)
    : DataError(std::string(Name(why)) + ": " + detail, hint), refusal(why) {}

FactorizationRefusal Classify(const ImagePoints& points, const std::vector<PairHomography>& homographies,
                              const std::optional<Camera>& camera) {
  if (homographies.empty()) return FactorizationRefusal::kTooFewTracks;
  std::vector<double> movement_px;
  std::vector<Eigen::Matrix3d> H_px;
  Eigen::Vector2d middle_px = Eigen::Vector2d::Zero();
  double radius_px = 0;
  const double share = 1.0 / static_cast<double>(homographies.size());
  for (const PairHomography& pair : homographies) {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    // Where the points of a typical spread go, in pixels of b.
    double most = 0;
    for (const double u : {-1.0, 1.0})
      for (const double v : {-1.0, 1.0}) {
        const Eigen::Vector3d q = pair.H * Eigen::Vector3d(u, v, 1);
        const Eigen::Vector2d from = Eigen::Vector2d(u, v) * points.px_per_unit[a] + points.centre_px[a];
        const Eigen::Vector2d to = q.hnormalized() * points.px_per_unit[b] + points.centre_px[b];
        most = std::max(most, (to - from).norm());
      }
    movement_px.push_back(most);
    H_px.push_back(NormalisedFromPixels(points, b).inverse() * pair.H * NormalisedFromPixels(points, a));
    middle_px += share * points.centre_px[a];
    radius_px += share * points.px_per_unit[a];
  }
  if (Median(movement_px) < kStillPx) return FactorizationRefusal::kNoMotion;

  // K R K^-1 under the camera, or under any focal length that a lens may have. What is left over is measured in pixels
  // and against the movement: a camera that slides along a plane looks the more like one that turns the longer its
  // lens.
  const auto unexplained = [&](const Eigen::Matrix3d& K) {
    std::vector<double> left;
    for (std::size_t i = 0; i < H_px.size(); ++i) {
      Eigen::Matrix3d R = K.inverse() * H_px[i] * K;
      const double scale = std::cbrt(R.determinant());
      if (!(std::abs(scale) > 0)) continue;
      R /= scale;
      left.push_back((R * R.transpose() - Eigen::Matrix3d::Identity()).norm() / 2 * K(0, 0) /
                     (movement_px[i] + kNoiseMovementPx));
    }
    return left.empty() ? std::numeric_limits<double>::infinity() : Median(left);
  };
  double least = std::numeric_limits<double>::infinity();
  if (camera) {
    least = unexplained(camera->K());
  } else {
    for (double focal = radius_px; focal < 20 * radius_px; focal *= 1.05) {
      Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
      K(0, 0) = K(1, 1) = focal;
      K.topRightCorner<2, 1>() = middle_px;
      least = std::min(least, unexplained(K));
    }
  }
  return least < kUnexplained ? FactorizationRefusal::kPureRotation : FactorizationRefusal::kPlanarScene;
}

void Refuse(const ImagePoints& points, const std::vector<PairHomography>& homographies,
            const std::optional<Camera>& camera) {
  const FactorizationRefusal why = Classify(points, homographies, camera);
  switch (why) {
    case FactorizationRefusal::kTooFewTracks:
      throw FactorizationRefused(why, "no two frames share 16 tracks that agree on one motion",
                                 "photos with more texture, or closer together");
    case FactorizationRefusal::kNoMotion:
      throw FactorizationRefused(why, "the camera does not move",
                                 "move the camera sideways by some percent of the scene's distance");
    case FactorizationRefusal::kPureRotation:
      throw FactorizationRefused(why, "the camera turns but does not move, so there is no depth",
                                 "move the camera, do not only turn it");
    case FactorizationRefusal::kPlanarScene:
      throw FactorizationRefused(why,
                                 "everything that is seen lies in one plane, which leaves the cameras undetermined",
                                 "photos with things at different depths");
  }
  throw FactorizationRefused(why, "", "");
}

}  // namespace lumi
