#include "render/time/photo_order.h"

#include <algorithm>
#include <numeric>

namespace lumi {
namespace {

// The moment of each photo: its time, its frame, or its place among the names.
std::vector<double> Moments(const Scene& scene) {
  const auto all = [&](auto&& has) { return std::all_of(scene.views.begin(), scene.views.end(), has); };
  const bool timed = all([](const View&v) { return v.time_s.has_value(); }),
             framed = all([](const View&v) { return v.frame_index.has_value(); });
  std::vector<double> moments;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    const View& v = scene.views[i];
    moments.push_back(
        timed ? *v.time_s : kAssumedFrame_s * (framed ? static_cast<double>(*v.frame_index) : static_cast<double>(i)));
  }
  return moments;
}

}  // namespace

PhotoOrder::PhotoOrder(const Scene& scene) : views_(scene.views.size()) {
  const std::vector<double> moments = Moments(scene);
  std::iota(views_.begin(), views_.end(), 0);
  std::stable_sort(views_.begin(), views_.end(), [&](int a, int b) {
    return moments[static_cast<std::size_t>(a)] < moments[static_cast<std::size_t>(b)];
  });
  for (const int v : views_) times_.push_back(moments[static_cast<std::size_t>(v)]);
}

int PhotoOrder::RankAt(double time_s) const {
  const auto after = std::lower_bound(times_.begin(), times_.end(), time_s);
  if (after == times_.end()) return count() - 1;
  const int rank = static_cast<int>(after - times_.begin());
  return rank > 0 && time_s - times_[static_cast<std::size_t>(rank - 1)] < *after - time_s ? rank - 1 : rank;
}

std::pair<int, int> PhotoOrder::Around(std::optional<double> time_s, int reach) const {
  if (reach < 0 || !time_s) return {0, count() - 1};
  const int rank = RankAt(*time_s);
  return {std::max(0, rank - reach), std::min(count() - 1, rank + reach)};
}

void GiveTimes(Scene& scene) {
  const std::vector<double> moments = Moments(scene);
  for (std::size_t i = 0; i < moments.size(); ++i) scene.views[i].time_s = moments[i];
}

}  // namespace lumi
