#include "reconstruct/epipolar_synchronise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "scene/files/video.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kPictureWidth = 240;       // finer than what the first guess takes: planes lie close together
constexpr double kCodingChange = 8;      // grey values
constexpr std::size_t kPlanes = 96;      // about two rows of a small picture each
constexpr double kLeastEnergy = 4;       // grey values a plane: below, what moves is a few noisy pixels
constexpr int kReach = 6;                // frames that a first guess may be off
constexpr int kLeastFrames = 16;         // that two videos share
constexpr double kNarrowest = 1e-4;      // rad: planes that both cameras see
constexpr double kNearest = 1e-9;        // distance of two centres, of their distance from the origin: no plane is told
constexpr double kSays = 0.1;            // correlation of motion that has to do with each other
constexpr int kMostRounds = 50;

// The logarithm of the change in each plane, frame by frame.
using Profile = std::vector<std::array<float, kPlanes>>;

struct PlanePair {
  Profile a, b;
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

Profile ProfileOf(const WatchedMotion& video, const std::vector<float>& angle, float low, float high) {
  Profile profile(video.frames.size());
  for (std::size_t i = 0; i < profile.size(); ++i) {
    profile[i].fill(0);
    for (const auto& [pixel, change] : video.frames[i]) {
      const float at = (angle[static_cast<std::size_t>(pixel)] - low) / (high - low) * static_cast<float>(kPlanes);
      if (at >= 0 && at < static_cast<float>(kPlanes)) profile[i][static_cast<std::size_t>(at)] += change;
    }
    for (float& energy : profile[i]) energy = std::log(static_cast<float>(kLeastEnergy) + energy);
  }
  return profile;
}

// The planes through both centres that both cameras see, by their angle; none where there is no such thing.
std::optional<PlanePair> PlanesOf(const WatchedMotion& a, const std::vector<Eigen::Vector3f>& rays_a, const WatchedMotion& b, const std::vector<Eigen::Vector3f>& rays_b) {
  const Eigen::Vector3d centre_a = a.cam_from_world.OriginInSource(), centre_b = b.cam_from_world.OriginInSource(), base = centre_b - centre_a;
  if (!(base.norm() > kNearest * (centre_a.norm() + centre_b.norm()))) return std::nullopt;
  const Eigen::Vector3d axis = base.normalized(), forward = a.cam_from_world.R().row(2) + b.cam_from_world.R().row(2);
  const Eigen::Vector3d across = forward - forward.dot(axis) * axis;
  // Cameras that look along the line between them: any plane may be the first.
  const Eigen::Vector3f e1 = (across.norm() > kNarrowest ? across.normalized() : axis.unitOrthogonal()).cast<float>(), e2 = axis.cast<float>().cross(e1);
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
  return PlanePair{ProfileOf(a, angles[0], low, high), ProfileOf(b, angles[1], low, high)};
}

// Over all planes and the frames that both show; each plane about its own mean, so that what always moves there says nothing.
double PlaneCorrelation(const Profile& a, const Profile& b, int lag) {
  const int first = std::max(1, 1 + lag), last = std::min(static_cast<int>(a.size()), static_cast<int>(b.size()) + lag), n = last - first;
  if (n < kLeastFrames) return 0;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t plane = 0; plane < kPlanes; ++plane) {
    double sum_a = 0, sum_b = 0, sum_ab = 0, sum_aa = 0, sum_bb = 0;
    for (int i = first; i < last; ++i) {
      const double x = static_cast<double>(a[static_cast<std::size_t>(i)][plane]), y = static_cast<double>(b[static_cast<std::size_t>(i - lag)][plane]);
      sum_a += x, sum_b += y, sum_ab += x * y, sum_aa += x * x, sum_bb += y * y;
    }
    ab += sum_ab - sum_a * sum_b / n;
    aa += sum_aa - sum_a * sum_a / n;
    bb += sum_bb - sum_b * sum_b / n;
  }
  constexpr double kRounding = 1e-9;
  return aa > kRounding * n && bb > kRounding * n ? ab / std::sqrt(aa * bb) : 0;
}

}  // namespace

WatchedMotion WatchMotion(const std::filesystem::path& video, const Camera& camera, const Rigid3& cam_from_world, ProgressSink& sink) {
  VideoReader reader(video);
  WatchedMotion motion;
  motion.cam_from_world = cam_from_world;
  Progress progress(sink, "following what moves in " + video.filename().string(), reader.frame_count_hint());
  cv::Mat before;
  while (auto frame = reader.Next()) {
    const cv::Mat rgb(frame->rgb.height, frame->rgb.width, CV_8UC3, frame->rgb.data.data());
    cv::Mat grey, small;
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    const double scale = std::min(1.0, static_cast<double>(kPictureWidth) / grey.cols);
    cv::resize(grey, small, cv::Size(), scale, scale, cv::INTER_AREA);
    small.convertTo(small, CV_32F);
    if (before.empty()) motion.camera = camera.Scaled(small.cols, small.rows);
    auto& changed = motion.frames.emplace_back();
    for (int i = 0; !before.empty() && i < small.rows * small.cols; ++i) {
      const auto change = static_cast<float>(std::abs(small.ptr<float>()[i] - before.ptr<float>()[i]) - kCodingChange);
      if (change > 0) changed.emplace_back(i, change);
    }
    before = small;
    progress.Step();
  }
  if (motion.frames.empty()) throw InputError(video, "no frame can be read", "re-encode it: ffmpeg -i IN OUT.mp4");
  return motion;
}

RefinedOffsets RefineOffsets(const std::vector<WatchedMotion>& videos, const std::vector<int>& offsets) {
  const std::size_t n = videos.size();
  std::vector<std::vector<Eigen::Vector3f>> rays(n);
  ParallelFor(n, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) rays[v] = RaysOf(videos[v]);
  });
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b) pairs.emplace_back(a, b);
  // Of each pair, at lags around the one given: both cameras may be off by the reach.
  std::vector<std::vector<double>> correlation(pairs.size());
  ParallelFor(pairs.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      const auto [a, b] = pairs[p];
      const auto planes = PlanesOf(videos[a], rays[a], videos[b], rays[b]);
      for (int d = -2 * kReach; d <= 2 * kReach; ++d) correlation[p].push_back(planes ? PlaneCorrelation(planes->a, planes->b, offsets[b] - offsets[a] + d) : 0);
    }
  });
  std::vector<int> moved(n, 0);
  const auto agreement = [&](std::size_t camera, int by) {  // of one camera's pairs, if it were moved by so much
    double sum = 0;
    for (std::size_t p = 0; p < pairs.size(); ++p) {
      const auto [a, b] = pairs[p];
      if (a != camera && b != camera) continue;
      sum += correlation[p][static_cast<std::size_t>((b == camera ? by : moved[b]) - (a == camera ? by : moved[a]) + 2 * kReach)];
    }
    return sum;
  };
  // One camera after the other, to where it agrees best with the others, until none moves.
  bool changed = true;
  for (int round = 0; changed && round < kMostRounds; ++round) {
    changed = false;
    for (std::size_t camera = 0; camera < n; ++camera) {
      int best = moved[camera];
      double best_sum = agreement(camera, best);
      for (int by = -kReach; by <= kReach; ++by)
        if (const double sum = agreement(camera, by); sum > best_sum + 1e-12) best = by, best_sum = sum;
      changed = changed || best != moved[camera];
      moved[camera] = best;
    }
  }
  RefinedOffsets refined{offsets, 0};
  for (std::size_t camera = 0; camera < n; ++camera) refined.correlation += agreement(camera, moved[camera]) / (2 * static_cast<double>(std::max<std::size_t>(1, pairs.size())));
  if (refined.correlation < kSays) {
    refined.correlation = 0;
    return refined;
  }
  for (std::size_t camera = 0; camera < n; ++camera) refined.offsets[camera] += moved[camera];
  const int least = *std::min_element(refined.offsets.begin(), refined.offsets.end());
  for (int& offset : refined.offsets) offset -= least;
  return refined;
}

}  // namespace lumi
