// The truth of simulated tracks as a projective model, for tests of the factorisation's parts.
#pragma once

#include <optional>

#include "factorization_scenes.h"
#include "reconstruct/factorization/normalise.h"
#include "reconstruct/factorization/projective_model.h"

namespace lumi::test {

constexpr double kNoisePx = 0.3;

// The truth as a projective model, moved by a frame change far from the identity.
inline ProjectiveModel TrueModel(const SimulatedTracks& s, const ImagePoints& points) {
  ProjectiveModel model(points);
  for (std::size_t f = 0; f < model.P.size(); ++f) {
    model.P[f] = (NormalisedFromPixels(points, f) * ProjectionMatrix(s.camera.K(), s.cam_from_world[f])).normalized();
    model.placed[f] = 1;
  }
  for (std::size_t t = 0; t < model.X.size(); ++t) {
    model.X[t] = s.x_in_world[t].normalized();
    model.solved[t] = 1;
  }
  Eigen::Matrix4d H;
  H << 1, 0.2, -0.3, 0.5, 0.1, 0.8, 0.4, -0.2, -0.3, 0.2, 1.1, 0.3, 0.25, -0.15, 0.3, 0.9;
  ChangeFrame(model, H);
  return model;
}

struct TrueScene {
  SimulatedTracks s;
  ImagePoints points;
  ProjectiveModel model;
};
inline TrueScene TrueSceneOf(const SimulatedTracks& s) {
  const ImagePoints points = Normalise(s.tracks, std::nullopt);
  return {s, points, TrueModel(s, points)};
}

}  // namespace lumi::test
