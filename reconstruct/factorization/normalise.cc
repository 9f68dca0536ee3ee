#include "reconstruct/factorization/normalise.h"

#include <cmath>

#include "scene/program/error.h"

namespace lumi {

ImagePoints Normalise(const Tracks& tracks, const std::optional<Camera>& camera) {
  const std::size_t n = tracks.frames.size();
  ImagePoints points;
  points.centre_px.assign(n, Eigen::Vector2d::Zero());
  points.px_per_unit.assign(n, 1.0);
  points.tracks.resize(tracks.tracks.size());
  const bool distorted = camera && !camera->IsPinhole();
  const Eigen::Vector2d focal = camera ? camera->FocalPx() : Eigen::Vector2d::Ones();
  const Eigen::Vector2d principal = camera ? camera->PrincipalPointPx() : Eigen::Vector2d::Zero();

  std::vector<int> count(n, 0);
  for (std::size_t t = 0; t < tracks.tracks.size(); ++t) {
    for (const TrackObservation& o : tracks.tracks[t].observations) {
      if (o.frame < 0 || static_cast<std::size_t>(o.frame) >= n)
        throw DataError("a track names frame " + std::to_string(o.frame) + ", which is not there");
      Eigen::Vector2d x = o.x_px;
      if (!x.allFinite()) continue;
      if (!points.tracks[t].empty() && points.tracks[t].back().frame >= o.frame) continue;
      if (distorted) {
        const auto ray = camera->Normalized(x);
        if (!ray) continue;
        x = focal.cwiseProduct(*ray) + principal;
      }
      points.tracks[t].push_back({o.frame, x});
      // Running means: exact to rounding however far the origin is.
      const auto f = static_cast<std::size_t>(o.frame);
      points.centre_px[f] += (x - points.centre_px[f]) / ++count[f];
    }
  }
  std::vector<double> sum(n, 0);
  for (const auto& track : points.tracks)
    for (const Sight& s : track)
      sum[static_cast<std::size_t>(s.frame)] +=
          (s.x - points.centre_px[static_cast<std::size_t>(s.frame)]).squaredNorm();
  for (std::size_t f = 0; f < n; ++f)
    if (sum[f] > 0) points.px_per_unit[f] = std::sqrt(sum[f] / (2 * count[f]));
  for (auto& track : points.tracks)
    for (Sight& s : track) {
      const auto f = static_cast<std::size_t>(s.frame);
      s.x = (s.x - points.centre_px[f]) / points.px_per_unit[f];
    }
  return points;
}

Eigen::Matrix3d NormalisedFromPixels(const ImagePoints& points, std::size_t f) {
  Eigen::Matrix3d T = Eigen::Matrix3d::Identity();
  T(0, 0) = T(1, 1) = 1 / points.px_per_unit[f];
  T.topRightCorner<2, 1>() = -points.centre_px[f] / points.px_per_unit[f];
  return T;
}

}  // namespace lumi
