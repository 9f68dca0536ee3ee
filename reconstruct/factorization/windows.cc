#include "reconstruct/factorization/windows.h"

#include <Eigen/Core>
#include <algorithm>

namespace lumi {
namespace {

// Shape (frames, frames): tracks seen in both.
Eigen::MatrixXi SharedTracks(const ImagePoints& points) {
  const auto n = static_cast<Eigen::Index>(points.FrameCount());
  Eigen::MatrixXi shared = Eigen::MatrixXi::Zero(n, n);
  for (const auto& track : points.tracks)
    for (std::size_t i = 0; i < track.size(); ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        ++shared(track[i].frame, track[j].frame);
        if (i != j) ++shared(track[j].frame, track[i].frame);
      }
  return shared;
}

std::vector<std::vector<int>> SubSequences(const Eigen::MatrixXi& shared, const WindowOptions& o) {
  std::vector<std::vector<int>> parts;
  std::vector<int> kept;
  for (int f = 0; f < shared.rows(); f += o.stride) kept.push_back(f);
  if (kept.back() != shared.rows() - 1) kept.push_back(static_cast<int>(shared.rows()) - 1);
  const int n = static_cast<int>(kept.size());
  const auto frame = [&](int i) { return kept[static_cast<std::size_t>(i)]; };
  int begin = 0;
  while (true) {
    int length = std::min(o.length, n - begin);
    while (length > std::min(std::max(o.length / 2, 3), n - begin) &&
           shared(frame(begin), frame(begin + length - 1)) < o.min_shared)
      --length;
    // A rest too short for a window of its own belongs to this one.
    if (n - begin - length < 2) length = n - begin;
    parts.emplace_back(kept.begin() + begin, kept.begin() + begin + length);
    if (begin + length >= n) return parts;
    begin += std::max(1, length - std::min(o.overlap, length / 2));
  }
}

// Grown from the photo that shares most with its peers; each further group starts at the photo that has most in common
// with those already in a group, and takes its best partners, of which the covered ones make the overlap.
std::vector<std::vector<int>> Groups(const Eigen::MatrixXi& shared, const WindowOptions& o) {
  const int n = static_cast<int>(shared.rows());
  std::vector<std::vector<int>> parts;
  std::vector<char> covered(static_cast<std::size_t>(n), 0);
  const auto is_covered = [&](int f) { return covered[static_cast<std::size_t>(f)] != 0; };
  while (true) {
    int seed = -1;
    long best = -1;
    for (int f = 0; f < n; ++f) {
      if (is_covered(f) || shared(f, f) == 0) continue;
      long with = 0;
      for (int g = 0; g < n; ++g)
        if (g != f && (parts.empty() || is_covered(g))) with += shared(f, g);
      if (with > best) best = with, seed = f;
    }
    if (seed < 0) return parts;
    // The overlap first (covered partners), then whoever shares most with the group.
    std::vector<int> group{seed};
    std::vector<long> link(static_cast<std::size_t>(n), 0);
    const auto add = [&](int f) {
      for (int g = 0; g < n; ++g) link[static_cast<std::size_t>(g)] += shared(f, g);
    };
    add(seed);
    const auto take_best = [&](bool only_covered) {
      int pick = -1;
      for (int g = 0; g < n; ++g) {
        if (std::ranges::find(group, g) != group.end() || (only_covered && !is_covered(g))) continue;
        if (link[static_cast<std::size_t>(g)] > 0 &&
            (pick < 0 || link[static_cast<std::size_t>(g)] > link[static_cast<std::size_t>(pick)]))
          pick = g;
      }
      if (pick < 0) return false;
      group.push_back(pick);
      add(pick);
      return true;
    };
    if (!parts.empty())
      for (int k = 0; k < o.overlap && static_cast<int>(group.size()) < o.length; ++k)
        if (!take_best(true)) break;
    while (static_cast<int>(group.size()) < o.length && take_best(false)) {
    }
    for (const int f : group) covered[static_cast<std::size_t>(f)] = 1;
    std::ranges::sort(group);
    parts.push_back(std::move(group));
  }
}

}  // namespace

std::string Validate(const WindowOptions& options) {
  if (options.stride < 1) return "window stride must be at least 1";
  if (options.length < 2) return "window length must be at least 2";
  if (options.overlap < 1 || options.overlap >= options.length)
    return "window overlap must be at least 1 and less than the window's length";
  return {};
}

FrameWindow MakeWindow(const ImagePoints& points, std::vector<int> frames) {
  FrameWindow window{std::move(frames), {}};
  std::vector<char> inside(points.FrameCount(), 0);
  for (const int f : window.frames) inside[static_cast<std::size_t>(f)] = 1;
  for (std::size_t t = 0; t < points.tracks.size(); ++t) {
    int n = 0;
    for (const Sight& s : points.tracks[t]) n += inside[static_cast<std::size_t>(s.frame)];
    if (n >= 2) window.tracks.push_back(static_cast<int>(t));
  }
  return window;
}

std::vector<FrameWindow> SplitIntoWindows(const ImagePoints& points, const WindowOptions& options) {
  std::vector<FrameWindow> windows;
  if (points.FrameCount() < 2) return windows;
  const Eigen::MatrixXi shared = SharedTracks(points);
  for (auto& frames : options.ordered ? SubSequences(shared, options) : Groups(shared, options))
    windows.push_back(MakeWindow(points, std::move(frames)));
  return windows;
}

ImagePoints Extract(const ImagePoints& points, const FrameWindow& window) {
  ImagePoints part;
  std::vector<int> local(points.FrameCount(), -1);
  for (std::size_t i = 0; i < window.frames.size(); ++i) {
    const auto f = static_cast<std::size_t>(window.frames[i]);
    local[f] = static_cast<int>(i);
    part.centre_px.push_back(points.centre_px[f]);
    part.px_per_unit.push_back(points.px_per_unit[f]);
  }
  for (const int t : window.tracks) {
    std::vector<Sight> sights;
    for (const Sight& s : points.tracks[static_cast<std::size_t>(t)])
      if (local[static_cast<std::size_t>(s.frame)] >= 0)
        sights.push_back({local[static_cast<std::size_t>(s.frame)], s.x});
    part.tracks.push_back(std::move(sights));
  }
  return part;
}

}  // namespace lumi
