#include "proxy/hull/mending.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr std::size_t kMostConflicts = 400;  // of a view: of more, every n-th pixel is asked
constexpr double kAsBad = 0.8;               // of the worst view's blame
constexpr double kMendingReserve = 0.8;      // of what may stay uncovered
constexpr double kLeastRadius = 1.5;  // of a mend, in pixels: the four pixels around a point are then of the object

constexpr float kMendReachPx = 8;  // from the silhouette, beyond the point where a ray is blocked least
constexpr double kClosePx = 3;     // gaps between mends: about twice as wide
constexpr double kNoHole = 0.1;    // share of a hole that is mended: beyond it, the whole hole is filled

// A pixel of `view` that no point of space explains.
struct Conflict {
  std::size_t view;
  AgreementRay ray;
  RayAgreement found;
  bool stale = true;         // silhouettes have changed since it was asked
  double share, spacing_px;  // of its silhouette that it stands for; distance of the next pixel that is asked
};

class Settling {
 public:
  Settling(const MendOptions& options, Carving& carving)
      : options_(options), carving_(carving), own_(carving_.views.size()), blame_(carving_.views.size()) {
    for (const SilhouetteView& view : carving_.views) pixels_.push_back(static_cast<double>(CountObject(view.mask)));
  }

  void Collect(const std::vector<std::vector<UncoveredPixel>>& uncovered, const RayCaster& rays) {
    for (std::size_t n = 0; n < carving_.agreement.used.size(); ++n) {
      const std::size_t v = carving_.agreement.used[n], every = 1 + uncovered[n].size() / kMostConflicts;
      for (std::size_t p = every / 2; p < uncovered[n].size(); p += every) {
        const UncoveredPixel& pixel = uncovered[n][p];
        const auto ray = rays.Through(v, pixel.x, pixel.y, pixel.depth_px);
        if (ray)
          conflicts_.push_back(
              {v, *ray, {}, true, static_cast<double>(every) / pixels_[v], std::sqrt(static_cast<double>(every))});
      }
    }
    Refresh([](const Conflict&) { return true; });
  }

  bool changed() const { return changed_; }

  // One step; false: there is nothing to do.
  bool Step() {
    Judge();
    std::size_t top = carving_.views.size();
    for (const std::size_t v : carving_.agreement.used)
      if (own_[v] + blame_[v] > 0 && (top == carving_.views.size() || own_[v] + blame_[v] > own_[top] + blame_[top]))
        top = v;
    if (top == carving_.views.size()) return false;
    // The worst view is treated together with those that are as bad.
    const auto as_bad = [&](std::size_t v) {
      return v == top || (blame_[v] >= own_[v] && blame_[v] >= kAsBad * blame_[top]);
    };
    if (Refresh([&](const Conflict& c) {
          return c.view == top || std::ranges::any_of(c.found.blockers, [&](std::int32_t k) {
                   return as_bad(static_cast<std::size_t>(k));
                 });
        }))
      return true;
    if (blame_[top] >= own_[top]) {
      if (MendFor([&](const Conflict&, std::size_t blocker) { return as_bad(blocker); })) return true;
      if (MendFor([&](const Conflict&, std::size_t blocker) { return blocker == top; }) || LeaveOut(top)) return true;
    } else {
      // The view shows what others do not: these are mended if that is little; else the view is left out.
      const bool little = own_[top] <= options_.max_excess;
      if (little && MendFor([&](const Conflict& c, std::size_t) { return c.view == top; })) return true;
      if (LeaveOut(top)) return true;
    }
    // Neither mended nor left out: it stays as it is.
    std::erase_if(conflicts_, [&](const Conflict& c) { return c.view == top || Blocks(c, top); });
    return true;
  }

 private:
  static bool Blocks(const Conflict& c, std::size_t view) {
    return std::ranges::find(c.found.blockers, static_cast<std::int32_t>(view)) != c.found.blockers.end();
  }

  // Follows those conflicts again that are stale and for which `which` holds; false: there are none.
  template <class Which>
  bool Refresh(Which which) {
    const std::vector<std::int32_t> order = SpreadOrder(carving_.agreement.used);
    const double cap = options_.agreement.max_dilation_px;
    std::vector<std::size_t> chosen;
    for (std::size_t n = 0; n < conflicts_.size(); ++n)
      if (conflicts_[n].stale && which(conflicts_[n])) chosen.push_back(n);
    ParallelEach(chosen.size(), 64, [&](std::size_t n) {
      conflicts_[chosen[n]].found = Follow(conflicts_[chosen[n]].ray, carving_.cones, order, cap);
      conflicts_[chosen[n]].stale = false;
    });
    std::erase_if(conflicts_, [&](const Conflict& c) { return c.found.needed_px <= cap; });
    return !chosen.empty();
  }

  // What each view lacks (own_) and keeps from others (blame_), in shares of silhouettes; of views that lack no more
  // than is spared nothing counts.
  void Judge() {
    std::ranges::fill(own_, 0.0);
    std::ranges::fill(blame_, 0.0);
    std::vector<double> share(carving_.views.size(), 0), deepest(carving_.views.size(), 0);
    for (const Conflict& c : conflicts_) {
      share[c.view] += c.share;
      deepest[c.view] = std::max<double>(deepest[c.view], c.ray.depth_px);
    }
    const auto fails = [&](std::size_t v) {
      return share[v] > kMendingReserve * options_.agreement.max_uncovered ||
             deepest[v] > options_.agreement.max_uncovered_depth_px;
    };
    std::erase_if(conflicts_, [&](const Conflict& c) { return !fails(c.view); });
    for (const Conflict& c : conflicts_) {
      own_[c.view] += c.share;
      for (const std::int32_t k : c.found.blockers)
        blame_[static_cast<std::size_t>(k)] += c.share / static_cast<double>(c.found.blockers.size());
    }
  }

  // Around the point where the ray is blocked least: as far as the same views alone block it, and little farther from
  // the silhouette.
  void AddMends(const Conflict& c, std::size_t blocker, std::vector<Mend>& mends) const {
    const auto cap = static_cast<float>(options_.agreement.max_dilation_px);
    const Image8& mask = carving_.views[blocker].mask;
    const double radius = std::max(kLeastRadius, c.spacing_px);
    const float farthest = carving_.cones[blocker].Distance(c.ray.At(c.found.blocked_at)) + kMendReachPx;
    const auto only_they_block = [&](const Eigen::Vector3d& x) {
      return std::ranges::all_of(carving_.agreement.used,
                                 [&](std::size_t v) { return carving_.cones[v].Distance(x) <= cap || Blocks(c, v); });
    };
    for (const int way : {1, -1}) {
      for (double s = c.found.blocked_at + (way < 0 ? -1 : 0); s >= 0 && s < c.ray.steps; s += way) {
        const Eigen::Vector3d x = c.ray.At(s);
        const float d = carving_.cones[blocker].Distance(x);
        if (s != c.found.blocked_at && (!(d > cap) || d > farthest || !only_they_block(x))) break;
        const auto at = Project(carving_.views[blocker].P, Eigen::Vector3d(carving_.origin + carving_.unit * x));
        if (!at) break;
        // A point beyond the image's side is mended at that side, which opens the silhouette there.
        const Mend mend{std::clamp(at->x(), 0.5, mask.width - 0.5), std::clamp(at->y(), 0.5, mask.height - 0.5), radius,
                        c.view};
        if (mends.empty() || std::hypot(mends.back().u - mend.u, mends.back().v - mend.v) > 0.5) mends.push_back(mend);
      }
    }
  }

  // Adds to the silhouettes of the blockers for which `which` holds; all of it or, where one would be mended too much,
  // nothing.
  template <class Which>
  bool MendFor(Which which) {
    if (!(options_.max_mended > 0)) return false;
    std::vector<std::vector<Mend>> more(carving_.views.size());
    for (const Conflict& c : conflicts_) {
      for (const std::int32_t k : c.found.blockers) {
        const auto blocker = static_cast<std::size_t>(k);
        if (which(c, blocker)) AddMends(c, blocker, more[blocker]);
      }
    }
    std::vector<std::size_t> changed;
    std::vector<Image8> masks;
    for (std::size_t v = 0; v < carving_.views.size(); ++v) {
      if (more[v].empty()) continue;
      more[v].insert(more[v].begin(), carving_.mends[v].begin(), carving_.mends[v].end());
      changed.push_back(v);
      masks.push_back(Mended(carving_.views[v].mask, more[v]));
      const auto pixels = static_cast<double>(CountObject(masks.back()));
      if (pixels > (1 + options_.max_mended) * pixels_[v] || pixels == static_cast<double>(masks.back().data.size()))
        return false;
    }
    if (changed.empty()) return false;
    changed_ = true;
    for (std::size_t n = 0; n < changed.size(); ++n) {
      carving_.mends[changed[n]] = std::move(more[changed[n]]);
      Recut(changed[n], std::move(masks[n]));
    }
    for (Conflict& c : conflicts_) c.stale = true;  // also what others were blamed for may be settled now
    return true;
  }

  void Recut(std::size_t view, Image8 mask) {
    carving_.cones[view] = SilhouetteCone({carving_.views[view].name, carving_.views[view].P, std::move(mask)},
                                          carving_.origin, carving_.unit);
  }

  bool LeaveOut(std::size_t view) {
    if (!options_.leave_out || carving_.agreement.used.size() <= 2) return false;
    changed_ = true;
    carving_.agreement.used.erase(std::ranges::find(carving_.agreement.used, view));
    carving_.agreement.left_out.push_back({view, blame_[view], own_[view]});
    std::erase_if(conflicts_, [&](const Conflict& c) { return c.view == view; });
    // Mends that were made in other silhouettes for its sake are undone.
    for (std::size_t v = 0; v < carving_.views.size(); ++v) {
      if (std::erase_if(carving_.mends[v], [&](const Mend& m) { return m.by == view; }) == 0) continue;
      Recut(v, Mended(carving_.views[v].mask, carving_.mends[v]));
    }
    for (Conflict& c : conflicts_) c.stale = true;
    return true;
  }

  const MendOptions& options_;
  Carving& carving_;
  std::vector<Conflict> conflicts_;
  std::vector<double> own_, blame_, pixels_;
  bool changed_ = false;
};

}  // namespace

Image8 Mended(const Image8& mask, const std::vector<Mend>& mends) {
  cv::Mat added = cv::Mat::zeros(mask.height, mask.width, CV_8U), object(mask.height, mask.width, CV_8U);
  for (const Mend& m : mends) {
    const int y_from = std::max(0, static_cast<int>(std::ceil(m.v - m.radius_px - 0.5)));
    const int y_to = std::min(mask.height - 1, static_cast<int>(std::floor(m.v + m.radius_px - 0.5)));
    const int x_from = std::max(0, static_cast<int>(std::ceil(m.u - m.radius_px - 0.5)));
    const int x_to = std::min(mask.width - 1, static_cast<int>(std::floor(m.u + m.radius_px - 0.5)));
    for (int y = y_from; y <= y_to; ++y) {
      for (int x = x_from; x <= x_to; ++x)
        if (std::hypot(x + 0.5 - m.u, y + 0.5 - m.v) <= m.radius_px) added.at<std::uint8_t>(y, x) = 255;
    }
  }
  // Mends stand for what lies between them and the silhouette, too.
  constexpr int kSide = 2 * static_cast<int>(kClosePx) + 1;
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) object.at<std::uint8_t>(y, x) = mask.At(x, y, 0) >= 128 ? 255 : 0;
  cv::Mat closed, near;
  const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {kSide, kSide});
  cv::morphologyEx(object | added, closed, cv::MORPH_CLOSE, disc);
  cv::dilate(added, near, disc);
  cv::Mat all = object | added | (closed & near);
  // Holes of the silhouette as it was.
  cv::Mat labels, stats, centroids;
  const int parts = cv::connectedComponentsWithStats(255 - object, labels, stats, centroids, 4, CV_32S);
  std::vector<int> filled(static_cast<std::size_t>(parts), 0);
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x)
      filled[static_cast<std::size_t>(labels.at<int>(y, x))] += all.at<std::uint8_t>(y, x) != 0 ? 1 : 0;
  std::vector<std::uint8_t> is_filled(filled.size(), 0);
  for (int p = 1; p < parts; ++p) {  // label 0: the object
    const int left = stats.at<int>(p, cv::CC_STAT_LEFT), top = stats.at<int>(p, cv::CC_STAT_TOP);
    const bool at_side = left == 0 || top == 0 || left + stats.at<int>(p, cv::CC_STAT_WIDTH) == mask.width ||
                         top + stats.at<int>(p, cv::CC_STAT_HEIGHT) == mask.height;
    is_filled[static_cast<std::size_t>(p)] =
        !at_side && filled[static_cast<std::size_t>(p)] > kNoHole * stats.at<int>(p, cv::CC_STAT_AREA) ? 1 : 0;
  }
  Image8 out(mask.width, mask.height, 1);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      const bool inside =
          all.at<std::uint8_t>(y, x) != 0 || is_filled[static_cast<std::size_t>(labels.at<int>(y, x))] != 0;
      out.At(x, y, 0) = inside ? 255 : 0;
    }
  }
  return out;
}

bool SettleConflicts(const std::vector<std::vector<UncoveredPixel>>& uncovered, const RayCaster& rays,
                     const MendOptions& options, Carving& carving, ProgressSink& progress) {
  Settling settling(options, carving);
  settling.Collect(uncovered, rays);
  Progress steps(progress, "mending silhouettes", 0);
  const AgreementOptions& agree = options.agreement;
  for (std::size_t n = 0; n < 20 * carving.views.size() && carving.agreement.used.size() >= agree.fewest_used; ++n) {
    agree.go_on();
    if (!settling.Step()) break;
    steps.Step();
  }
  return settling.changed();
}

}  // namespace lumi
