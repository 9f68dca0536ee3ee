#include "reconstruct/factorization/homographies.h"

#include <Eigen/LU>
#include <algorithm>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "reconstruct/factorization/reprojection_cost.h"
#include "reconstruct/factorization/track_bundle.h"
#include "scene/geometry/levenberg_marquardt.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

using RowMajor3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

constexpr int kFewestShared = 8;           // tracks of two frames that a homography is taken from ...
constexpr double kFewestAgree = 0.25;      // ... and the share of them that has to agree
constexpr std::size_t kFewestOfKeys = 24;  // tracks that two keys in a row share
constexpr double kBehindPx2 = 1e6;         // what a sight behind its camera counts for: one 1000 px off
constexpr double kOutlierPx = 4;           // after the adjustment; what moves, or stands out of the plane

struct FrameSight {
  int track = -1, observation = -1;
  Eigen::Vector2d x = Eigen::Vector2d::Zero();  // px from the middle of the picture, over half its longer side
};

struct Units {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double px = 1;
  explicit Units(const Eigen::Vector2i& size)
      : centre_px(0.5 * size.cast<double>()), px(0.5 * std::max(1, size.maxCoeff())) {}
  Eigen::Vector2d Of(const Eigen::Vector2d& x_px) const { return (x_px - centre_px) / px; }
  Eigen::Matrix3d PxFromUnits() const {
    Eigen::Matrix3d K = Eigen::Matrix3d::Identity();
    K.topLeftCorner<2, 2>() *= px;
    K.topRightCorner<2, 1>() = centre_px;
    return K;
  }
};

std::vector<std::vector<FrameSight>> SightsOfFrames(const Tracks& tracks, const std::vector<Units>& units) {
  std::vector<std::vector<FrameSight>> frames(tracks.frames.size());
  for (std::size_t t = 0; t < tracks.tracks.size(); ++t)
    for (std::size_t k = 0; k < tracks.tracks[t].observations.size(); ++k) {
      const TrackObservation& o = tracks.tracks[t].observations[k];
      const auto f = static_cast<std::size_t>(o.frame);
      frames[f].push_back({static_cast<int>(t), static_cast<int>(k), units[f].Of(o.x_px)});
    }
  return frames;  // each frame's by track, ascending
}

// b ~ H a, positive in front (w > 0 where it agrees). px: pixels a unit.
std::optional<Eigen::Matrix3d> Between(const std::vector<FrameSight>& a, const std::vector<FrameSight>& b, double px,
                                       const HomographyOptions& options) {
  std::vector<cv::Point2d> x, y;
  for (std::size_t i = 0, j = 0; i < a.size() && j < b.size();) {
    if (a[i].track == b[j].track) {
      x.emplace_back(a[i].x.x(), a[i].x.y());
      y.emplace_back(b[j].x.x(), b[j].x.y());
      ++i, ++j;
    } else {
      ++(a[i].track < b[j].track ? i : j);
    }
  }
  if (x.size() < kFewestShared) return std::nullopt;
  cv::Mat agree;
  const cv::Mat found = cv::findHomography(x, y, cv::RANSAC, options.inlier_px / px, agree, 2000, 0.999);
  if (found.empty() ||
      cv::countNonZero(agree) < std::max(kFewestShared, static_cast<int>(kFewestAgree * static_cast<double>(x.size()))))
    return std::nullopt;
  Eigen::Matrix3d H;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) H(r, c) = found.at<double>(r, c);
  int front = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (agree.at<std::uint8_t>(static_cast<int>(i)) != 0)
      front += H.row(2).dot(Eigen::Vector3d(x[i].x, x[i].y, 1)) > 0 ? 1 : -1;
  const double det = H.determinant();
  if (!(std::abs(det) > 1e-9) || (det < 0) != (front < 0)) return std::nullopt;  // mirrored
  return H / std::cbrt(det);
}

// Of a frame's sights those of the longest tracks: they tie the most frames together.
std::vector<FrameSight> Longest(std::vector<FrameSight> sights, const Tracks& tracks, int most) {
  if (most <= 0 || sights.size() <= static_cast<std::size_t>(most)) return sights;
  const auto length = [&](const FrameSight& s) {
    return tracks.tracks[static_cast<std::size_t>(s.track)].observations.size();
  };
  std::ranges::stable_sort(sights, [&](const FrameSight& a, const FrameSight& b) { return length(a) > length(b); });
  sights.resize(static_cast<std::size_t>(most));
  return sights;
}

// What is known, and what is sought: a matrix each frame, a direction each track.
struct TurnedFrames {
  const Tracks& tracks;
  const HomographyOptions& options;
  std::vector<Units> units;
  std::vector<std::vector<FrameSight>> frames;
  std::vector<RowMajor3d> G;
  std::vector<Eigen::Vector3d> d;
  std::vector<char> solved;  // a track each
};

// The frames of `keys` and the tracks that two of them see, all at once.
void AdjustKeys(TurnedFrames& turned, const std::vector<std::size_t>& keys, std::size_t fixed) {
  auto& [tracks, options, units, frames, G, d, solved] = turned;
  ceres::CauchyLoss loss(1.0);
  ceres::SphereManifold<9> frame_sphere;
  ceres::SphereManifold<3> point_sphere;
  ceres::Problem problem(TrackBundle::NothingOwned());
  ceres::Solver::Options solver;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  std::vector<int> seen(d.size(), 0);
  for (const std::size_t f : keys) {
    G[f].normalize();
    problem.AddParameterBlock(G[f].data(), 9, &frame_sphere);
    ordering->AddElementToGroup(G[f].data(), 1);
    for (const FrameSight& sight : frames[f]) ++seen[static_cast<std::size_t>(sight.track)];
  }
  problem.SetParameterBlockConstant(G[fixed].data());
  std::vector<char> used(d.size(), 0);
  for (const std::size_t f : keys) {
    std::vector<FrameSight> shared = frames[f];
    std::erase_if(shared, [&](const FrameSight& sight) {
      return seen[static_cast<std::size_t>(sight.track)] < 2 || !solved[static_cast<std::size_t>(sight.track)];
    });
    for (const FrameSight& sight : Longest(shared, tracks, options.sights_per_frame)) {
      const auto t = static_cast<std::size_t>(sight.track);
      if (!used[t]) {
        problem.AddParameterBlock(d[t].data(), 3, &point_sphere);
        ordering->AddElementToGroup(d[t].data(), 0);
        used[t] = 1;
      }
      problem.AddResidualBlock(new ReprojectionCost<3>(sight.x, units[f].px), &loss, G[f].data(), d[t].data());
    }
  }
  if (problem.NumResidualBlocks() == 0) return;
  solver.linear_solver_ordering = ordering;
  solver.linear_solver_type = ceres::SPARSE_SCHUR;
  solver.max_num_iterations = options.max_iterations;
  solver.function_tolerance = 1e-6;
  solver.num_threads = 1;  // sums in one order: the same bytes each time
  solver.logging_type = ceres::SILENT;
  const std::vector<RowMajor3d> before = G;
  const std::vector<Eigen::Vector3d> points_before = d;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  bool usable = summary.IsSolutionUsable();
  for (const RowMajor3d& g : G) usable = usable && g.allFinite();
  if (!usable) {
    G = before;
    d = points_before;
  }
}

// Where a track's sights say that it is, on average; solved where they do not contradict each other.
void Intersect(TurnedFrames& turned) {
  auto& [tracks, options, units, frames, G, d, solved] = turned;
  std::ranges::fill(d, Eigen::Vector3d::Zero());
  std::vector<int> seen(d.size(), 0);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const Eigen::Matrix3d inverse = G[f].inverse();
    for (const FrameSight& sight : frames[f]) {
      d[static_cast<std::size_t>(sight.track)] += (inverse * sight.x.homogeneous()).normalized();
      ++seen[static_cast<std::size_t>(sight.track)];
    }
  }
  for (std::size_t t = 0; t < d.size(); ++t) {
    solved[t] = seen[t] > 1 && d[t].norm() > 0.5 * seen[t];
    if (solved[t]) d[t].normalize();
  }
}

// One unknown u, a direction of N numbers, against sights under Cauchy's loss at a pixel. `residual(u, k, r, J)`:
// pixels of sight k and their derivatives; false behind the camera. u as it was where nothing is gained.
template <int N, typename Residual>
void FitDirection(std::size_t count, const Residual& residual, Eigen::Matrix<double, N, 1>& u) {
  const auto cost = [&](const Eigen::Matrix<double, N, 1>& at, NormalEquations<N>* normal) {
    double sum = 0;
    Eigen::Vector2d r;
    Eigen::Matrix<double, 2, N> J;
    for (std::size_t k = 0; k < count; ++k) {
      const bool in_front = residual(at, k, r, normal ? &J : nullptr);
      const RobustLoss loss = Cauchy(in_front ? r.squaredNorm() : kBehindPx2, 1);
      sum += loss.cost;
      if (normal && in_front) normal->Add(J, r, loss.weight);
    }
    return sum;
  };
  MinimiseSquares<N>({.max_iterations = 12,
                      .max_attempts = 4,
                      .tolerance = 1e-7,
                      .damping = 1e-4,
                      .min_damping = 1e-7,
                      .damping_rise = 10,
                      .homogeneous = true},
                     cost, u);
}

struct TurnedImage {
  Eigen::Vector2d y;
  double scale;  // pixels a unit of the image, over its depth
};
std::optional<TurnedImage> Turned(const RowMajor3d& G, const Eigen::Vector3d& d, double px) {
  const Eigen::Vector3d q = G * d;
  if (!(q.z() > 1e-9)) return std::nullopt;
  return TurnedImage{q.head<2>() / q.z(), px / q.z()};
}

// Each frame against the points as they are, each point against the frames as they are: both in parallel, both exact
// minima of their own, so that in the end every frame and point fits all of its sights, not only those in keyframes.
void AdjustFrames(TurnedFrames& turned, const std::vector<char>& which) {
  auto& [tracks, options, units, frames, G, d, solved] = turned;
  ParallelEach(frames.size(), 4, [&](std::size_t f) {
    if (!which[f]) return;
    std::vector<FrameSight> sights = frames[f];
    std::erase_if(sights, [&](const FrameSight& sight) { return !solved[static_cast<std::size_t>(sight.track)]; });
    if (sights.size() < kFewestShared) return;
    sights = Longest(std::move(sights), tracks, options.sights_per_frame);
    Eigen::Matrix<double, 9, 1> u = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(G[f].data());
    FitDirection<9>(
        sights.size(),
        [&](const Eigen::Matrix<double, 9, 1>& at, std::size_t k, Eigen::Vector2d& r, Eigen::Matrix<double, 2, 9>* J) {
          const Eigen::Vector3d& direction = d[static_cast<std::size_t>(sights[k].track)];
          const auto image = Turned(Eigen::Map<const RowMajor3d>(at.data()), direction, units[f].px);
          if (!image) return false;
          r = (image->y - sights[k].x) * units[f].px;
          if (J) {
            J->setZero();
            for (int i = 0; i < 2; ++i) {
              J->template block<1, 3>(i, 3 * i) = image->scale * direction.transpose();
              J->template block<1, 3>(i, 6) = -image->scale * image->y[i] * direction.transpose();
            }
          }
          return true;
        },
        u);
    G[f] = Eigen::Map<const RowMajor3d>(u.data());
  });
}

void AdjustPoints(const std::vector<std::vector<std::pair<std::size_t, Eigen::Vector2d>>>& sights,
                  TurnedFrames& turned) {
  auto& [tracks, options, units, frames, G, d, solved] = turned;
  ParallelEach(d.size(), 64, [&](std::size_t t) {
    if (!solved[t]) return;
    FitDirection<3>(
        sights[t].size(),
        [&](const Eigen::Vector3d& at, std::size_t k, Eigen::Vector2d& r, Eigen::Matrix<double, 2, 3>* J) {
          const std::size_t f = sights[t][k].first;
          const auto image = Turned(G[f], at, units[f].px);
          if (!image) return false;
          r = (image->y - sights[t][k].second) * units[f].px;
          if (J)
            for (int i = 0; i < 2; ++i) J->row(i) = image->scale * (G[f].row(i) - image->y[i] * G[f].row(2));
          return true;
        },
        d[t]);
  });
}

// Frames as far apart as most tracks are long, so that few of them tie the video together; the middle one, the first
// and the last.
std::vector<std::size_t> ChooseKeys(const std::vector<std::vector<FrameSight>>& frames) {
  const std::size_t n = frames.size(), middle = n / 2;
  const auto shared = [&](std::size_t a, std::size_t b) {
    std::size_t both = 0;
    for (std::size_t i = 0, j = 0; i < frames[a].size() && j < frames[b].size();)
      if (frames[a][i].track == frames[b][j].track)
        ++both, ++i, ++j;
      else
        ++(frames[a][i].track < frames[b][j].track ? i : j);
    return both;
  };
  for (const std::size_t apart : {12U, 8U, 5U, 3U, 2U, 1U}) {
    std::vector<std::size_t> keys;
    for (std::size_t f = middle % apart; f < n; f += apart) keys.push_back(f);
    if (keys.front() != 0) keys.insert(keys.begin(), 0);
    if (keys.back() != n - 1) keys.push_back(n - 1);
    bool enough = true;
    for (std::size_t k = 0; k + 1 < keys.size(); ++k) {
      const std::size_t both = shared(keys[k], keys[k + 1]),
                        fewer = std::min(frames[keys[k]].size(), frames[keys[k + 1]].size());
      enough = enough && (both >= kFewestOfKeys && 5 * both >= 2 * fewer);
    }
    if (enough || apart == 1) return keys;
  }
  return {};
}

// Outwards from the middle: each frame from its neighbour on the middle's side.
void ChainFrames(TurnedFrames& turned, std::vector<MissingFrame>& unlinked, ProgressSink& progress) {
  auto& [tracks, options, units, frames, G, d, solved] = turned;
  const std::size_t n = frames.size(), middle = n / 2;
  G.assign(n, RowMajor3d::Identity());
  Progress steps(progress, "homographies", static_cast<long>(n));
  std::vector<std::optional<Eigen::Matrix3d>> link(n);
  ParallelEach(n, 1, [&](std::size_t f) {
    if (f != middle)
      link[f] =
          Between(turned.frames[f > middle ? f - 1 : f + 1], turned.frames[f], turned.units[f].px, turned.options);
    steps.Step();
  });
  const auto chain = [&](std::size_t from, std::size_t to) {
    turned.G[to] = turned.G[from];
    if (link[to]) {
      turned.G[to] = *link[to] * turned.G[from];
      turned.G[to].normalize();
    } else {
      MissingFrame& missing = unlinked.emplace_back();
      missing.frame = static_cast<int>(to);
      missing.reason = "shares too few features with its neighbour: taken not to have moved";
    }
  };
  for (std::size_t f = middle; f + 1 < n; ++f) chain(f, f + 1);
  for (std::size_t f = middle; f > 0; --f) chain(f, f - 1);
}

// Coarse to fine: the keys with all that ties them, the frames between them on what that found, then everything in
// turns.
void AdjustInTurns(TurnedFrames& turned) {
  const std::size_t n = turned.frames.size(), middle = n / 2;
  std::vector<std::vector<std::pair<std::size_t, Eigen::Vector2d>>> sights_of(turned.d.size());
  for (std::size_t f = 0; f < n; ++f)
    for (const FrameSight& s : turned.frames[f]) sights_of[static_cast<std::size_t>(s.track)].emplace_back(f, s.x);
  const std::vector<std::size_t> keys = ChooseKeys(turned.frames);
  const std::vector<RowMajor3d> chained = turned.G;
  AdjustKeys(turned, keys, middle);
  std::vector<char> between(n, 1), all(n, 1);
  all[middle] = 0;
  for (std::size_t f = 0, k = 0; f < n; ++f) {
    while (k + 1 < keys.size() && keys[k + 1] <= f) ++k;
    const std::size_t key = k + 1 < keys.size() && keys[k + 1] - f < f - keys[k] ? keys[k + 1] : keys[k];
    if (f == key)
      between[f] = 0;
    else
      turned.G[f] = chained[f] * chained[key].inverse() * turned.G[key];
    turned.G[f].normalize();
  }
  AdjustPoints(sights_of, turned);
  AdjustFrames(turned, between);
  for (int round = 0; round < turned.options.rounds; ++round) {
    CheckInterrupted();
    AdjustPoints(sights_of, turned);
    AdjustFrames(turned, all);
  }
  AdjustPoints(sights_of, turned);
}

// Cameras, points and the sights that agree.
void TakeResult(const TurnedFrames& turned, FactorizationResult& result) {
  const auto& [tracks, options, units, frames, G, d, solved] = turned;
  result.placed.assign(frames.size(), 1);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    Matrix34d P = Matrix34d::Zero();
    const Eigen::Matrix3d M = units[f].PxFromUnits() * G[f];
    P.leftCols<3>() = M / M.norm();
    result.P.push_back(P);
  }
  double sum = 0;
  std::vector<double> square(d.size(), 0);
  std::vector<FactorizationPoint> points(d.size());
  for (std::size_t f = 0; f < frames.size(); ++f)
    for (const FrameSight& s : frames[f]) {
      const auto t = static_cast<std::size_t>(s.track);
      if (!solved[t]) continue;
      const Eigen::Vector3d q = G[f] * d[t];
      const double error = q.z() > 0 ? (q.hnormalized() - s.x).norm() * units[f].px : 1e300;
      if (error > kOutlierPx) {
        ++result.culled;
        continue;
      }
      points[t].observations.push_back(s.observation);
      points[t].error_px += error;
      square[t] += error * error;
    }
  for (std::size_t t = 0; t < points.size(); ++t) {
    FactorizationPoint& p = points[t];
    if (p.observations.size() < 2) continue;
    std::ranges::sort(p.observations);
    p.track = static_cast<int>(t);
    p.X = Eigen::Vector4d(d[t].x(), d[t].y(), d[t].z(), 1).normalized();
    p.error_px /= static_cast<double>(p.observations.size());
    sum += square[t];
    result.sights += static_cast<long>(p.observations.size());
    result.points.push_back(std::move(p));
  }
  result.rms_px = result.projective_rms_px =
      result.sights > 0 ? std::sqrt(sum / static_cast<double>(result.sights)) : 0;
}

}  // namespace

FactorizationResult ReconstructByHomographies(const Tracks& tracks, const HomographyOptions& options,
                                              ProgressSink& progress) {
  const Stopwatch watch;
  if (tracks.frames.empty()) throw DataError("there are no frames to relate");
  TurnedFrames turned{tracks,
                      options,
                      {},
                      {},
                      {},
                      std::vector<Eigen::Vector3d>(tracks.tracks.size()),
                      std::vector<char>(tracks.tracks.size(), 0)};
  for (const Tracks::Frame& frame : tracks.frames) turned.units.emplace_back(frame.size_px);
  turned.frames = SightsOfFrames(tracks, turned.units);
  FactorizationResult result;
  ChainFrames(turned, result.missing, progress);
  Intersect(turned);
  AdjustInTurns(turned);
  // Whatever sign was found: the sights must lie in front.
  for (std::size_t f = 0; f < turned.frames.size(); ++f) {
    int front = 0;
    for (const FrameSight& s : turned.frames[f])
      if (const auto t = static_cast<std::size_t>(s.track); turned.solved[t])
        front += turned.G[f].row(2).dot(turned.d[t]) > 0 ? 1 : -1;
    if (front < 0) turned.G[f] = -turned.G[f];
  }
  result.upgrade = UpgradeKind::kQuasiAffine;
  result.upgrade_reason = "the frames have no structure: they are related by homographies";
  TakeResult(turned, result);
  result.seconds.total = watch.Seconds();
  return result;
}

int AddDirectionsWhereBlank(FactorizationResult& result, Tracks& tracks) {
  constexpr std::size_t kFewest = 24;  // points that a frame sees
  constexpr int kColumns = 6, kRows = 4, kEvery = 10;
  const auto n = static_cast<int>(tracks.frames.size());
  std::vector<std::size_t> seen(tracks.frames.size(), 0);
  for (const FactorizationPoint& p : result.points)
    for (const int o : p.observations)
      ++seen[static_cast<std::size_t>(
          tracks.tracks[static_cast<std::size_t>(p.track)].observations[static_cast<std::size_t>(o)].frame)];
  int added = 0;
  for (int first = 0; first < n;) {
    if (seen[static_cast<std::size_t>(first)] >= kFewest) {
      ++first;
      continue;
    }
    int last = first;  // blank frames in a row, tens at a time
    while (last + 1 < n && last + 1 < first + kEvery && seen[static_cast<std::size_t>(last + 1)] < kFewest) ++last;
    const int from = (first + last) / 2, low = first == last ? std::max(0, first - 1) : first,
              high = first == last ? std::min(n - 1, first + 1) : last;
    const Tracks::Frame& frame = tracks.frames[static_cast<std::size_t>(from)];
    const Eigen::Matrix3d inverse = result.P[static_cast<std::size_t>(from)].leftCols<3>().inverse();
    for (int i = 0; i < kColumns * kRows; ++i) {
      const Eigen::Vector2d x((i % kColumns + 0.5) / kColumns * frame.size_px.x(),
                              (i / kColumns + 0.5) / kRows * frame.size_px.y());
      Eigen::Vector3d d = inverse * x.homogeneous();
      d.normalize();
      Track track;
      track.color = {128, 128, 128};
      for (int f = low; f <= high; ++f) {
        const Eigen::Vector3d q = result.P[static_cast<std::size_t>(f)].leftCols<3>() * d;
        const Eigen::Vector2i& size = tracks.frames[static_cast<std::size_t>(f)].size_px;
        if (q.z() > 0 && q.x() >= 0 && q.y() >= 0 && q.x() <= size.x() * q.z() && q.y() <= size.y() * q.z())
          track.observations.push_back({f, q.hnormalized()});
      }
      if (track.observations.size() < 2) continue;
      FactorizationPoint point;
      point.track = static_cast<int>(tracks.tracks.size());
      point.X = Eigen::Vector4d(d.x(), d.y(), d.z(), 1).normalized();
      for (std::size_t o = 0; o < track.observations.size(); ++o) point.observations.push_back(static_cast<int>(o));
      result.points.push_back(std::move(point));
      tracks.tracks.push_back(std::move(track));
      ++added;
    }
    first = last + 1;
  }
  return added;
}

int PlaceByHomography(FactorizationResult& result, const Tracks& tracks, const HomographyOptions& options) {
  if (result.upgrade == UpgradeKind::kMetric) return 0;
  std::vector<Units> units;
  for (const Tracks::Frame& frame : tracks.frames) units.emplace_back(frame.size_px);
  const auto frames = SightsOfFrames(tracks, units);
  int placed = 0;
  const auto pass = [&](std::size_t from, std::size_t to) {
    if (!result.placed[from] || result.placed[to]) return;
    const auto H = Between(frames[from], frames[to], units[to].px, options);
    if (!H) return;
    result.P[to] = units[to].PxFromUnits() * *H * units[from].PxFromUnits().inverse() * result.P[from];
    result.P[to] /= result.P[to].norm();
    result.placed[to] = 1;
    ++placed;
  };
  for (std::size_t f = 0; f + 1 < frames.size(); ++f) pass(f, f + 1);
  for (std::size_t f = frames.size(); f-- > 1;) pass(f, f - 1);
  std::erase_if(result.missing,
                [&](const MissingFrame& m) { return result.placed[static_cast<std::size_t>(m.frame)] != 0; });
  return placed;
}

}  // namespace lumi
