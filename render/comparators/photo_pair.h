// Two photos and a view between them, for methods that interpolate two images.
#pragma once

#include <optional>

#include "render/comparators/photo_rank.h"
#include "render/comparators/point_method.h"

namespace lumi {

struct PhotoPair {
  std::int32_t first = 0, second = 0;
  double share = 0;  // of the second: the view's position on the baseline from the first centre to the second, [0, 1]
};

// Among the photos nearest to the view, the pair whose baseline passes closest to it; baselines with the view near
// their middle come before those with it at an end. rectifiable: only pairs in which neither photo contains the other's
// centre, so that a homography for each makes their epipolar lines parallel. nullopt: no pair is left.
std::optional<PhotoPair> PairAround(const Sources& sources, const ViewSetup& setup, double median_depth,
                                    bool rectifiable);

// Dissolves between the pair. Where only one of them sees a point, that one is used; where neither does, the photo
// nearest in angle.
class PairMethod : public PointMethod {
 public:
  explicit PairMethod(const PhotoPair& pair) : pair_(pair) {}

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo& memo, WeightedPhotos& out) const override;

 private:
  PhotoPair pair_;
};

}  // namespace lumi
