#include "reconstruct/factorization/take_result.h"

namespace lumi {

void TakePoints(const ImagePoints& points, const ProjectiveModel& model, const Tracks& tracks,
                FactorizationResult& result) {
  result.points.clear();
  result.sights = 0;
  for (std::size_t t = 0; t < points.tracks.size(); ++t) {
    if (!model.solved[t]) continue;
    FactorizationPoint point;
    point.track = static_cast<int>(t);
    point.X = model.X[t];
    const auto& observations = tracks.tracks[t].observations;
    std::size_t o = 0;
    for (std::size_t k = 0; k < points.tracks[t].size(); ++k) {
      const Sight& s = points.tracks[t][k];
      if (!model.inlier[t][k] || !model.placed[static_cast<std::size_t>(s.frame)]) continue;
      while (o < observations.size() && observations[o].frame != s.frame) ++o;
      point.observations.push_back(static_cast<int>(o));
      point.error_px += ReprojectionErrorPx(points, model, s, t);
    }
    if (point.observations.size() < 2) continue;
    point.error_px /= static_cast<double>(point.observations.size());
    result.sights += static_cast<long>(point.observations.size());
    result.points.push_back(std::move(point));
  }
}

void TakeCameras(const ImagePoints& points, const ProjectiveModel& model, FactorizationResult& result) {
  result.placed = model.placed;
  result.P.assign(model.P.size(), Matrix34d::Zero());
  for (std::size_t f = 0; f < model.P.size(); ++f) {
    if (!model.placed[f]) continue;
    Eigen::Matrix3d pixels_from_normalised = Eigen::Matrix3d::Identity();
    pixels_from_normalised(0, 0) = pixels_from_normalised(1, 1) = points.px_per_unit[f];
    pixels_from_normalised.topRightCorner<2, 1>() = points.centre_px[f];
    result.P[f] = pixels_from_normalised * model.P[f];
  }
}

}  // namespace lumi
