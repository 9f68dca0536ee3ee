// Photos that have a share of the whole view, and count at a point by it, by how squarely they saw the surface, less
// towards their borders and where the surface may hide the point: what view-based methods have in common.
#pragma once

#include <vector>

#include "render/comparators/point_method.h"

namespace lumi {

class ViewShareMethod : public PointMethod {
 public:
  // share: of each photo, 0: it is not one of the view's; power: of the cosine between normal and photo.
  ViewShareMethod(std::vector<double> share, double power) : share_(std::move(share)), power_(power) {}

 protected:
  // Where none of the view's photos sees the point, the photo nearest in angle.
  void AtPoint(const PhotosAtPoint& point, WindowMemo& memo, WeightedPhotos& out) const override;
  // What is left of a photo that sees the point to this part.
  virtual double Seen(double visibility) const { return visibility; }

 private:
  std::vector<double> share_;
  double power_;
};

}  // namespace lumi
