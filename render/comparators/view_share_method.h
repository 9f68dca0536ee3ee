// The common part of view-based methods: each photo has a share of the whole view. At a point it counts by this share
// and by how squarely it saw the surface, less towards its border and where the surface may hide the point.
#pragma once

#include <vector>

#include "render/comparators/point_method.h"

namespace lumi {

class ViewShareMethod : public PointMethod {
 public:
  // share: for each photo, 0: not used for this view; power: of the cosine between the normal and the direction to the
  // photo.
  ViewShareMethod(std::vector<double> share, double power) : share_(std::move(share)), power_(power) {}

 protected:
  // Where none of the view's photos sees the point, the photo nearest in angle.
  void AtPoint(const PhotosAtPoint& point, WindowMemo& memo, WeightedPhotos& out) const override;
  // The factor for a photo that sees the point with this visibility.
  virtual double Seen(double visibility) const { return visibility; }

 private:
  std::vector<double> share_;
  double power_;
};

}  // namespace lumi
