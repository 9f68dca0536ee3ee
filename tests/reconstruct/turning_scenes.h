// Tracks of a camera that only turns and zooms, and how far homographies between its frames are from the truth.
#pragma once

#include <Eigen/LU>

#include "factorization_scenes.h"
#include "reconstruct/factorization/homographies.h"

namespace lumi::test {

struct TurningVideo {
  SimulatedTracks sight;
  std::vector<Eigen::Matrix3d> G;  // pixels from directions
};

struct TurningOptions {
  int frames = 60;
  double pan_deg = 30, zoom = 1;  // over the whole video
  double shake_rad = 0.01;
  double noise_px = 0.3;
  double movers = 0;  // share of the tracks that move by themselves, together
  int points = 600, track_frames = 60;
};

inline TurningVideo Turn(const TurningOptions& o) {
  TurningVideo turning;
  std::vector<Rigid3> path;
  std::vector<double> zoom;
  for (int f = 0; f < o.frames; ++f) {
    const double u = o.frames > 1 ? f / (o.frames - 1.0) : 0;
    const Eigen::Quaterniond q =
        Eigen::AngleAxisd(o.shake_rad * std::sin(0.9 * f), Eigen::Vector3d::UnitX()) *
        Eigen::AngleAxisd(-o.pan_deg * kRadPerDeg * u + o.shake_rad * std::sin(1.3 * f + 1), Eigen::Vector3d::UnitY()) *
        Eigen::AngleAxisd(o.shake_rad * std::sin(0.5 * f), Eigen::Vector3d::UnitZ());
    path.push_back({q, Eigen::Vector3d::Zero()});
    zoom.push_back(std::pow(o.zoom, u));
  }
  std::vector<Eigen::Vector4d> points;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  const double reach = 40 * kRadPerDeg;
  for (int i = 0; i < o.points; ++i) {
    const double a = -reach + (o.pan_deg * kRadPerDeg + 2 * reach) * uniform(random), up = -0.5 + uniform(random);
    points.emplace_back(5 * std::sin(a), 5 * up, 5 * std::cos(a), 1);
  }
  turning.sight = See(path, points, Tracked(o.noise_px, o.track_frames));
  const Eigen::Matrix3d K = turning.sight.camera.K();
  const Eigen::Vector2d middle(K(0, 2), K(1, 2));
  for (int f = 0; f < o.frames; ++f) {
    Eigen::Matrix3d Z = Eigen::Matrix3d::Identity();
    Z.topLeftCorner<2, 2>() *= zoom[static_cast<std::size_t>(f)];
    Z.topRightCorner<2, 1>() = (1 - zoom[static_cast<std::size_t>(f)]) * middle;
    turning.G.push_back(Z * K * path[static_cast<std::size_t>(f)].R());
  }
  auto& tracks = turning.sight.tracks.tracks;
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    const bool moves = static_cast<double>(t % 10) < 10 * o.movers;
    const double since = tracks[t].observations.front().frame;
    for (TrackObservation& at : tracks[t].observations) {
      at.x_px = middle + zoom[static_cast<std::size_t>(at.frame)] * (at.x_px - middle);
      if (moves) at.x_px += Eigen::Vector2d(2.5, 0.7) * (at.frame - since);
    }
  }
  return turning;
}

// Largest distance over a grid of frame f's picture between where frame f + step's truth and result put it; RMS over
// frames.
inline double TransferErrorPx(const TurningVideo& truth, const FactorizationResult& r, std::size_t step) {
  double sum = 0;
  int count = 0;
  for (std::size_t f = 0; f + step < truth.G.size(); ++f) {
    const Eigen::Matrix3d true_H = truth.G[f + step] * truth.G[f].inverse(),
                          H = r.P[f + step].leftCols<3>() * r.P[f].leftCols<3>().inverse();
    for (int i = 0; i < 9; ++i) {
      const Eigen::Vector3d x(0.25 * kWidthPx * (1 + i % 3), 0.25 * kHeightPx * (1 + i / 3), 1);
      sum += ((true_H * x).hnormalized() - (H * x).hnormalized()).squaredNorm();
      ++count;
    }
  }
  return std::sqrt(sum / count);
}

}  // namespace lumi::test
