#include "reconstruct/factorization/refusal.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "reconstruct/factorization/normalise.h"

namespace lumi {
namespace {

constexpr double kStillPx = 0.75;          // at the photo's corners
constexpr double kRotationTolerance = 0.02;

double Median(std::vector<double> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

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

FactorizationRefusal Classify(const ImagePoints& points, const std::vector<PairHomography>& homographies, const std::optional<Camera>& camera) {
  if (homographies.empty()) return FactorizationRefusal::kTooFewTracks;
  std::vector<double> movement_px, off_rotation;
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
    Eigen::Matrix3d H = NormalisedFromPixels(points, b).inverse() * pair.H * NormalisedFromPixels(points, a);
    if (camera) H = camera->K().inverse() * H * camera->K();
    const double scale = std::cbrt(H.determinant());
    if (!(std::abs(scale) > 0)) continue;
    H /= scale;
    if (camera) {
      off_rotation.push_back((H * H.transpose() - Eigen::Matrix3d::Identity()).norm());
    } else {
      // K R K^-1 under one K has a rotation's eigenvalues.
      const Eigen::Vector3cd values = H.eigenvalues();
      off_rotation.push_back(std::max({std::abs(std::abs(values[0]) - 1), std::abs(std::abs(values[1]) - 1), std::abs(std::abs(values[2]) - 1)}));
    }
  }
  if (Median(movement_px) < kStillPx) return FactorizationRefusal::kNoMotion;
  if (!off_rotation.empty() && Median(off_rotation) < kRotationTolerance) return FactorizationRefusal::kPureRotation;
  return FactorizationRefusal::kPlanarScene;
}

}  // namespace lumi
