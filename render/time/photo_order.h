// The photos in the order in which they were taken.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

class PhotoOrder {
 public:
  // By time where all photos carry one, else by the frame of the video, else by name.
  explicit PhotoOrder(const Scene& scene);
  int count() const { return static_cast<int>(views_.size()); }
  int view(int rank) const { return views_[static_cast<std::size_t>(rank)]; }
  // The photo that a picture of this moment is of: the nearest in time.
  int RankAt(double time_s) const;
  // Ranks [first, last] of the photos at most `reach` to either side of a moment; all of them where reach < 0 or there
  // is no moment.
  std::pair<int, int> Around(std::optional<double> time_s, int reach) const;

 private:
  std::vector<int> views_;
  std::vector<double> times_;  // of the same, ascending
};

// Time from one photo to the next if no time is known: that of a video's frames.
constexpr double kAssumedFrame_s = 1.0 / 30;
// Gives photos without times one, in their order; the order is all that the window around a moment needs.
void GiveTimes(Scene& scene);

}  // namespace lumi
