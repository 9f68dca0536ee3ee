// Colours of a batch of pixels on one plane from weighted photos: what the sparse and the candidate blend share.
#pragma once

#include <span>
#include <vector>

#include "render/cpu/layers.h"
#include "render/cpu/photo_maps.h"
#include "render/cpu/sparse_blend.h"
#include "render/radiance/frame_plan.h"

namespace lumi {

// A photo over the pixels of one plane. All functions about the same reference pixel.
struct PhotoLayer {
  std::size_t photo = 0;
  PhotoMap map;       // in the photo's pixels
  Linear weight;      // read by Shade with interpolated weights
  bool ends = false;  // its weight is gated
  Linear level;       // of its pyramid
  int first_level = 0, last_level = 0;
};

// A point of the proxy, relative to the view's centre, and the surface's normal there.
struct SurfacePoint {
  Eigen::Vector3f offset, normal;
  float facing = 0, depth = 0;  // normal.offset, and along the view's axis
};

class LayerShader {
 public:
  LayerShader(const ViewSetup& setup, const BlendSources& sources);

  // Everything but the weight and `ends`. `corners`: where the photo's level is taken, between them it is linear.
  PhotoLayer Layer(std::size_t photo, const LinearD& inverse_depth, const std::array<Eigen::Vector2d, 3>& corners_px,
                   const Eigen::Matrix3d& linear_from_corners, int x, int y) const;

  // Interpolated weights. `sums_to_one`: no layer is gated, the weights sum to 1 and the negative ones to -1 or more.
  void Shade(LayerBatch& b, const std::vector<PhotoLayer>& layers, bool sums_to_one, std::vector<float>& scratch,
             float* rgba) const;
  // A layer for a batch of pixels with depths of their own: at the mean of the levels that some of them call for.
  PhotoLayer LayerAtDepths(std::size_t photo, std::span<const SurfacePoint> points, int x, int y) const;
  // Given weights: `weights` holds kBatch floats a layer, which sum to 1 wherever b.alpha > 0 (field of view on) or to
  // alpha.
  void ShadeWeighted(LayerBatch& b, const std::vector<PhotoLayer>& layers, const std::vector<float>& weights,
                     float* rgba) const;

 private:
  void Add(LayerBatch& b, int begin, int end, const PhotoLayer& layer, const float* weight) const;
  // Of a pyramid's level 0, which may be a halved photo; 0 behind the photo, where it is not read.
  double Level(std::size_t photo, double facing_ratio, double depth_ratio) const;
  void Store(LayerBatch& b, bool normalised, float* rgba) const;

  const ViewSetup& setup_;
  const BlendSources& sources_;
  const PhotoMaps maps_;
  float weight_one_ = kWeightOne;  // lower where a gain above 1, or a weight of 2, must fit
  float lowest_weight_ = 0;        // of interpolated ones
};

// Coefficients of the function that is linear in the image and takes given values at three corners: value = (a, b, c)
// M. False for corners on a line.
bool LinearFromCorners(const std::array<Eigen::Vector2d, 3>& x_px, Eigen::Matrix3d& out);

}  // namespace lumi
