// One number for each photo, from values that photos share at scene points: log value = a_point + b_photo, by
// alternating least squares with Huber weights. Sparse, and well conditioned where tracks overlap.
#pragma once

#include <cstddef>
#include <vector>

namespace lumi {

struct PhotoSample {
  std::size_t point, photo;  // numbered from 0; "photo" may also stand for a part of a photo
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
  double prior = 0;    // strength of the prior b = 0, in samples
  int rounds = 12;     // of points given photos, photos given points
};

PointPhotoFit FitPointsAndPhotos(const std::vector<PhotoSample>& samples, std::size_t points, std::size_t photos,
                                 const PointPhotoFitOptions& options);

}  // namespace lumi
