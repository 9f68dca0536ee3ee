// SIFT features of one picture (Lowe 2004; OpenCV's), as RootSIFT (Arandjelovic and Zisserman 2012), at the places
// where they are: OpenCV's, a quarter of a pixel off, are put right.
//
// Same picture and options, same features in the same order, whatever the number of threads.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "scene/model/image.h"
#include "scene/tracks/match_bytes.h"
#include "scene/tracks/match_descriptors.h"

namespace lumi {

enum class SiftOrder {
  kStrongest,  // by the contrast of the spot, each place once
  kLargest,    // by the size of the spot, each orientation of a place: what COLMAP keeps
};

struct SiftOptions {
  int max_features = 2048;  // the first of their order are kept
  int max_size_px = 1600;   // the picture is scaled down to this longer side
  SiftOrder order = SiftOrder::kStrongest;
  double contrast = 0.04;  // OpenCV's threshold for three layers an octave; 0.02 is COLMAP's
};

struct SiftFeature {
  Eigen::Vector2d x_px = Eigen::Vector2d::Zero();  // of the picture itself, from its corner
  double scale_px = 0;                             // standard deviation of the spot, pixels of the picture itself
  double orientation_rad = 0;
};

struct SiftFeatures {
  std::vector<SiftFeature> features;
  Descriptors descriptors;  // one row a feature, of unit length
  double scale = 1;         // scaled picture / picture
};

// mask: one channel of the picture's size, 0 = no feature there; empty: nothing is masked. image: 1 or 3 channels. Of a
// picture with a side below 16 px (scaled) no feature.
SiftFeatures FindSift(const Image8& image, const Image8& mask, const SiftOptions& options);

// 512 times, rounded: as COLMAP keeps them.
ByteDescriptors ToBytes(const Descriptors& descriptors);

}  // namespace lumi
