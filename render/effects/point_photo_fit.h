// One number a photo, from what photos have in common at scene points: log value = a_point + b_photo, by alternating
// least squares with Huber weights. Sparse, and well conditioned where tracks overlap.
#pragma once

#include <cstddef>
#include <vector>

namespace lumi {

struct PhotoSample {
  std::size_t point, photo;  // of any numbering that begins at 0; "photo" may be a part of one
  double log_value;
};

struct PointPhotoFit {
  // One a photo.
  std::vector<double> log_photo;   // b, mean 0 over the photos that have samples; 0 where there are none
  std::vector<double> weight_sum;  // of its samples
  std::vector<double> square_sum;  // their squared residuals, weighted
};

struct PointPhotoFitOptions {
  double huber = 0.1;  // log units: residuals beyond count as outliers
  double prior = 0;    // samples' worth of belief that b is 0
  int rounds = 12;     // of points given photos, photos given points
};

PointPhotoFit FitPointsAndPhotos(const std::vector<PhotoSample>& samples, std::size_t points, std::size_t photos,
                                 const PointPhotoFitOptions& options);

}  // namespace lumi
