#include "reconstruct/epipolar_synchronise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "reconstruct/synchronise.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr int kPictureWidth = 240;      // finer than what the first guess takes: planes lie close together
constexpr int kCodingChange = 8;        // grey values
constexpr std::ptrdiff_t kPlanes = 64;  // about three rows of a small picture each
constexpr double kLeastEnergy = 16;     // grey values a plane: below, what moves is a few noisy pixels
constexpr int kReach = 6;               // frames that a first guess may be off
constexpr int kFramesAhead = 2;         // of the first that is watched: decoded to find the nearest in time
constexpr int kLeastFrames = 16;        // that two videos share
constexpr double kNarrowest = 1e-4;     // rad: planes that both cameras see
constexpr double kNearest = 1e-9;       // distance of two centres, of their distance from the origin: no plane is told
constexpr double kSays = 0.1;           // correlation below which two motions are unrelated
constexpr double kMostAlike = 0.999;    // of a correlation: beyond, its logarithm says how little noise there is
constexpr double kRounding = 1e-9;
constexpr int kMostRounds = 50;

// The logarithm of what moves in each plane, frame by frame; [0]: change, [1]: foreground.
using Profile = std::vector<std::array<float, static_cast<std::size_t>(kPlanes)>>;
using Profiles = std::array<Profile, 2>;

struct PlanePair {
  Profiles a, b;
};

std::vector<Eigen::Vector3f> RaysOf(const WatchedMotion& video) {
  std::vector<Eigen::Vector3f> rays;
  const Eigen::Matrix3d world_from_cam = video.cam_from_world.R().transpose();
  for (int y = 0; y < video.camera.height_px; ++y)
    for (int x = 0; x < video.camera.width_px; ++x) {
      const auto n = video.camera.Normalized({x + 0.5, y + 0.5});
      rays.push_back(n ? Eigen::Vector3f((world_from_cam * n->homogeneous()).cast<float>()) : Eigen::Vector3f::Zero());
    }
  return rays;
}

Profiles ProfilesOf(const WatchedMotion& video, const std::vector<float>& angle, float low, float high) {
  Profiles profiles;
  for (std::size_t kind = 0; kind < profiles.size(); ++kind) {
    for (const WatchedMotion::Pixels& pixels : kind == 0 ? video.change : video.foreground) {
      auto& planes = profiles[kind].emplace_back();
      planes.fill(0);
      for (const auto& [pixel, value] : pixels) {
        // Shared between the two nearest, so that cameras that are a little off make little difference.
        const float at = (angle[static_cast<std::size_t>(pixel)] - low) / (high - low) * static_cast<float>(kPlanes) -
                         0.5F,
                    below = std::floor(at), share = at - below;
        const auto plane = static_cast<std::ptrdiff_t>(below);
        if (plane >= 0 && plane < kPlanes) planes[static_cast<std::size_t>(plane)] += (1 - share) * value;
        if (plane >= -1 && plane + 1 < kPlanes) planes[static_cast<std::size_t>(plane + 1)] += share * value;
      }
      for (float& energy : planes) energy = std::log(static_cast<float>(kLeastEnergy) + energy);
    }
  }
  return profiles;
}

// The planes through both centres that both cameras see, by their angle; none where there is no such thing.
std::optional<PlanePair> PlanesOf(const WatchedMotion& a, const std::vector<Eigen::Vector3f>& rays_a,
                                  const WatchedMotion& b, const std::vector<Eigen::Vector3f>& rays_b) {
  const Eigen::Vector3d centre_a = a.cam_from_world.OriginInSource(), centre_b = b.cam_from_world.OriginInSource(),
                        base = centre_b - centre_a;
  if (!(base.norm() > kNearest * (centre_a.norm() + centre_b.norm()))) return std::nullopt;
  const Eigen::Vector3d axis = base.normalized(), forward = a.cam_from_world.R().row(2) + b.cam_from_world.R().row(2);
  const Eigen::Vector3d across = forward - forward.dot(axis) * axis;
  // Cameras that look along the line between them: any plane may be the first.
  const Eigen::Vector3f e1 = (across.norm() > kNarrowest ? across.normalized() : axis.unitOrthogonal()).cast<float>(),
                        e2 = axis.cast<float>().cross(e1);
  float low = -4, high = 4;
  std::vector<float> angles[2];
  for (int k = 0; k < 2; ++k) {
    float least = 4, most = -4;
    for (const Eigen::Vector3f& ray : k == 0 ? rays_a : rays_b) {
      const bool seen = ray.squaredNorm() > 0;
      angles[k].push_back(seen ? std::atan2(ray.dot(e2), ray.dot(e1)) : 9.0F);
      if (seen) least = std::min(least, angles[k].back()), most = std::max(most, angles[k].back());
    }
    low = std::max(low, least);
    high = std::min(high, most);
  }
  if (!(high - low > kNarrowest)) return std::nullopt;
  return PlanePair{ProfilesOf(a, angles[0], low, high), ProfilesOf(b, angles[1], low, high)};
}

// Over all planes and the frames that both show; each plane about its own mean, so that what always moves there says
// nothing.
double PlaneCorrelation(const Profile& a, const Profile& b, int lag) {
  const int first = std::max(1, 1 + lag), last = std::min(static_cast<int>(a.size()), static_cast<int>(b.size()) + lag),
            n = last - first;
  if (n < kLeastFrames) return 0;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t plane = 0; plane < static_cast<std::size_t>(kPlanes); ++plane) {
    double sum_a = 0, sum_b = 0, sum_ab = 0, sum_aa = 0, sum_bb = 0;
    for (int i = first; i < last; ++i) {
      const double x = static_cast<double>(a[static_cast<std::size_t>(i)][plane]),
                   y = static_cast<double>(b[static_cast<std::size_t>(i - lag)][plane]);
      sum_a += x, sum_b += y, sum_ab += x * y, sum_aa += x * x, sum_bb += y * y;
    }
    ab += sum_ab - sum_a * sum_b / n;
    aa += sum_aa - sum_a * sum_a / n;
    bb += sum_bb - sum_b * sum_b / n;
  }
  return aa > kRounding * n && bb > kRounding * n ? ab / std::sqrt(aa * bb) : 0;
}

// Each camera alone, and what a maximum spanning tree of the pairs falls into where one of its edges is cut.
std::vector<std::vector<bool>> GroupsOf(std::size_t n, const std::vector<std::pair<std::size_t, std::size_t>>& pairs,
                                        const std::vector<double>& strength) {
  std::vector<std::size_t> order(pairs.size()), part(n);
  for (std::size_t p = 0; p < order.size(); ++p) order[p] = p;
  std::ranges::stable_sort(order, [&](std::size_t x, std::size_t y) { return strength[x] > strength[y]; });
  for (std::size_t camera = 0; camera < n; ++camera) part[camera] = camera;
  std::vector<std::pair<std::size_t, std::size_t>> tree;
  for (const std::size_t p : order) {
    const auto [a, b] = pairs[p];
    if (part[a] == part[b]) continue;
    tree.push_back(pairs[p]);
    const std::size_t from = part[b], to = part[a];
    std::replace(part.begin(), part.end(), from, to);
  }
  std::vector<std::vector<bool>> groups;
  for (std::size_t camera = 0; camera < n; ++camera) {
    groups.emplace_back(n, false);
    groups.back()[camera] = true;
  }
  for (std::size_t cut = 0; cut < tree.size(); ++cut) {
    std::vector<bool> group(n, false);
    group[tree[cut].second] = true;
    for (std::size_t grown = 0; grown < tree.size(); ++grown)  // as often as a path may be long
      for (std::size_t e = 0; e < tree.size(); ++e)
        if (e != cut && group[tree[e].first] != group[tree[e].second])
          group[tree[e].first] = group[tree[e].second] = true;
    groups.push_back(std::move(group));
  }
  return groups;
}

}  // namespace

WatchedMotion WatchMotion(const std::filesystem::path& video, const VideoClock& clock, double fps, int first,
                          const Camera& camera, const Rigid3& cam_from_world, ProgressSink& sink) {
  VideoReader reader(video);
  Progress progress(sink, "following what moves in " + video.filename().string(),
                    std::min<long>(reader.frame_count_hint(), kWatchedFrames));
  std::vector<cv::Mat> frames;
  const auto before_first = [&] {
    return reader.frames_read() == 0 || CommonFrame(clock, reader.time_s(), fps) < first - kFramesAhead;
  };
  while (first > kFramesAhead && before_first() && reader.Skip()) {
  }
  // Each frame is watched up to the middle between it and the next.
  cv::Mat last;
  double last_at = 0;
  const auto watch_until = [&](double end) {
    while (static_cast<int>(frames.size()) < kWatchedFrames && first + static_cast<double>(frames.size()) < end) {
      frames.push_back(last);
      progress.Step();
    }
  };
  while (static_cast<int>(frames.size()) < kWatchedFrames) {
    auto frame = reader.Next();
    if (!frame) break;
    const double at = CommonFrame(clock, frame->time_s, fps);
    if (!last.empty()) watch_until(0.5 * (last_at + at));
    const cv::Mat rgb(frame->rgb.height, frame->rgb.width, CV_8UC3, frame->rgb.data.data());
    cv::Mat grey;
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    const double scale = std::min(1.0, static_cast<double>(kPictureWidth) / grey.cols);
    last = cv::Mat();
    cv::resize(grey, last, cv::Size(), scale, scale, cv::INTER_AREA);
    last_at = at;
  }
  if (!last.empty()) watch_until(last_at + 0.5);
  if (frames.empty()) throw InputError(video, "no frame can be read", "re-encode it: ffmpeg -i IN OUT.mp4");
  const int pixels = frames[0].rows * frames[0].cols;
  std::vector<std::uint8_t> median(static_cast<std::size_t>(pixels));
  ParallelFor(median.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint8_t> values(frames.size());
    for (std::size_t p = begin; p < end; ++p) {
      for (std::size_t i = 0; i < frames.size(); ++i) values[i] = frames[i].ptr()[p];
      std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
      median[p] = values[values.size() / 2];
    }
  });
  WatchedMotion motion{camera.Scaled(frames[0].cols, frames[0].rows), cam_from_world, {}, {}};
  motion.change.resize(frames.size());
  motion.foreground.resize(frames.size());
  ParallelEach(frames.size(), 1, [&](std::size_t i) {
    for (int p = 0; p < pixels; ++p) {
      const int value = frames[i].ptr()[p],
                change = i > 0 ? std::abs(value - frames[i - 1].ptr()[p]) - kCodingChange : 0,
                beyond = std::abs(value - median[static_cast<std::size_t>(p)]) - kCodingChange;
      if (change > 0) motion.change[i].emplace_back(p, static_cast<float>(change));
      if (beyond > 0) motion.foreground[i].emplace_back(p, static_cast<float>(beyond));
    }
  });
  return motion;
}

OffsetCorrections CorrectOffsets(const std::vector<WatchedMotion>& videos, const std::vector<int>& offsets) {
  const std::size_t n = videos.size();
  std::vector<std::vector<Eigen::Vector3f>> rays(n);
  ParallelEach(n, 1, [&](std::size_t v) { rays[v] = RaysOf(videos[v]); });
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b) pairs.emplace_back(a, b);
  // Of each pair, at lags around the one given: both cameras may be off by the reach.
  struct Agreement {
    double likelihood = 0, correlation = 0;
  };
  std::vector<std::vector<Agreement>> agreement(pairs.size());
  ParallelEach(pairs.size(), 1, [&](std::size_t p) {
    const auto [a, b] = pairs[p];
    const auto planes = PlanesOf(videos[a], rays[a], videos[b], rays[b]);
    for (int d = -2 * kReach; d <= 2 * kReach; ++d) {
      Agreement& at = agreement[p].emplace_back();
      for (std::size_t kind = 0; planes && kind < planes->a.size(); ++kind) {
        const double c = std::clamp(PlaneCorrelation(planes->a[kind], planes->b[kind], offsets[b] - offsets[a] + d),
                                    0.0, kMostAlike);
        at.likelihood -= std::log(1 - c * c);
        at.correlation += c / static_cast<double>(planes->a.size());
      }
    }
  });
  std::vector<int> moved(n, 0);
  const auto total = [&](const std::vector<int>& by, double Agreement::*what) {
    double sum = 0;
    for (std::size_t p = 0; p < pairs.size(); ++p)
      sum += agreement[p][static_cast<std::size_t>(by[pairs[p].second] - by[pairs[p].first] + 2 * kReach)].*what;
    return sum;
  };
  // Single cameras, and groups that the best pairs connect, are moved one after another to where they agree best with
  // the others, until none moves. Groups move as a whole, since cameras that agree among themselves would hold each
  // other in place.
  std::vector<double> strength;
  for (const std::vector<Agreement>& of : agreement)
    strength.push_back(std::ranges::max_element(of, [](const Agreement& x, const Agreement& y) {
                         return x.likelihood < y.likelihood;
                       })->likelihood);
  const std::vector<std::vector<bool>> groups = GroupsOf(n, pairs, strength);
  bool changed = true;
  for (int round = 0; changed && round < kMostRounds; ++round) {
    changed = false;
    for (const std::vector<bool>& group : groups) {
      std::vector<int> best = moved;
      double best_sum = total(moved, &Agreement::likelihood);
      for (int by = -2 * kReach; by <= 2 * kReach; ++by) {
        std::vector<int> tried = moved;
        for (std::size_t camera = 0; camera < n; ++camera) tried[camera] += group[camera] ? by : 0;
        if (std::ranges::any_of(tried, [](int m) { return std::abs(m) > kReach; })) continue;
        if (const double sum = total(tried, &Agreement::likelihood); sum > best_sum + kRounding)
          best = tried, best_sum = sum;
      }
      changed = changed || best != moved;
      moved = best;
    }
  }
  OffsetCorrections corrections{
      moved, total(moved, &Agreement::correlation) / static_cast<double>(std::max<std::size_t>(1, pairs.size()))};
  if (corrections.correlation < kSays) corrections = {std::vector<int>(n, 0), 0};
  return corrections;
}

}  // namespace lumi
