// Two photos and a view between them: what methods that interpolate two images know of a scene.
#pragma once

#include <optional>

#include "render/comparators/photo_rank.h"
#include "render/comparators/point_method.h"

namespace lumi {

struct PhotoPair {
  std::int32_t first = 0, second = 0;
  double share = 0;  // of the second: how far along the way from the first centre to the second the view lies, [0, 1]
};

// Of the photos nearest to the view the pair whose way passes it most closely, ways with the view beside their middle
// before those with it at an end. rectifiable: only pairs of which neither photo's frame shows the other's centre, so
// that one homography each makes their epipolar lines parallel. nullopt: no pair is left.
std::optional<PhotoPair> PairAround(const Sources& sources, const ViewSetup& setup, double median_depth,
                                    bool rectifiable);

// Dissolves the pair; where only one sees a point, that one; where neither does, the photo nearest in angle.
class PairMethod : public PointMethod {
 public:
  explicit PairMethod(const PhotoPair& pair) : pair_(pair) {}

 protected:
  void AtPoint(const PhotosAtPoint& point, WindowMemo& memo, WeightedPhotos& out) const override;

 private:
  PhotoPair pair_;
};

}  // namespace lumi
