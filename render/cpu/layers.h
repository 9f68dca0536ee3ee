// The inner loops of the CPU's blending: a batch of pixels of one plane, a photo at a time. On a plane a photo's pixel
// is a homography of the view's: u w, v w, w and interpolated weights are linear in the view's pixels, and one division
// a layer and pixel remains. Colours are summed in integers: a bilinear sample and its weight are four 16-bit weights,
// whose own sum is what the colour is divided by, so that a constant world stays constant.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/photos/photo_set.h"

namespace lumi {

// Pixels a batch; its arrays stay in the first-level cache.
constexpr int kBatch = 256;
// Integer weight of 1. 255 times it fits 32 bits.
constexpr float kWeightOne = 32767;

// c + x X + y Y over a batch's pixels, and, where a batch has depths of its own (PixelDepths), + d / depth.
struct Linear {
  float c = 0, x = 0, y = 0, d = 0;
};

// Pixels of a photo from pixels of the view.
struct PhotoMap {
  Linear u, v, w;
};

// One level of a photo's pyramid, at least 2 x 2 pixels, RGB.
struct LevelView {
  const std::uint8_t* base = nullptr;
  int width = 0, height = 0;
};

// All photos' levels; photos of one pixel's width or height are copied wider.
class PhotoLevels {
 public:
  // seen: how often each photo is halved at least; empty: as it is.
  explicit PhotoLevels(const std::vector<Photo>& photos, std::span<const int> seen = {});
  int shift(std::size_t photo) const { return entries_[photo].shift; }  // level 0 is the photo halved this often
  int count(std::size_t photo) const { return entries_[photo].count; }
  const LevelView& level(std::size_t photo, int level) const {
    return levels_[static_cast<std::size_t>(entries_[photo].first + level)];
  }

 private:
  struct Entry {
    int first = 0, count = 0, shift = 0;
  };
  std::vector<Entry> entries_;
  std::vector<LevelView> levels_;
  std::vector<Image8> widened_;
};

// A batch: arrays of kBatch, used up to `n`; kernels read and write up to the next multiple of 16.
struct LayerBatch {
  int n = 0;
  bool depths = false;          // maps read inverse_depth; else the batch lies in one plane
  alignas(64) float x[kBatch];  // pixels, relative to a reference of the caller's
  alignas(64) float y[kBatch];
  alignas(64) std::int32_t pixel[kBatch];   // where the result goes
  alignas(64) float inverse_depth[kBatch];  // read where `depths` says so
  alignas(64) float weight[kBatch];
  alignas(64) float alpha[kBatch];
  alignas(64) float scale[kBatch];
  alignas(64) std::int32_t offset[kBatch];
  alignas(64) std::int32_t top[kBatch];  // two 16-bit weights each
  alignas(64) std::int32_t bottom[kBatch];
  alignas(64) std::int32_t sum[kBatch];
  alignas(64) std::int32_t color[4 * kBatch];
  alignas(64) float rgb[4 * kBatch];  // of constant colours

  int padded() const { return (n + 15) / 16 * 16; }
  void Pad();                  // repeats the last pixel
  void Clear(bool constants);  // rgb, or sum and color
};

// out = max(lowest, f)
void EvaluateWeights(const LayerBatch& b, const Linear& f, float lowest, float* out);
// Feathered gate: min(1, f / kAlphaFullAt) at each pixel, f the raised cosine over feather_px at the photo's border;
// for feather_px = 0 whether the photo contains the point. 0 behind the camera.
void EvaluateGate(const LayerBatch& b, const PhotoMap& map, float width_px, float height_px, float feather_px,
                  float* out);
// out *= max(0, 1 - |clamp(f, 0, last) - level|): this level's share of a trilinear sample.
void ScaleByLevel(const LayerBatch& b, const Linear& f, float last, float level, float* out);
// Where each pixel of [begin, end), multiples of 16 or the batch's end, falls in a level (`map` in the level's own
// pixels) and with which integer weights, negative ones, too (weight * weight_one within +-kWeightOne); adds to b.sum.
void MapToLevel(LayerBatch& b, int begin, int end, const PhotoMap& map, const LevelView& level, const float* weight,
                float weight_one);
// Adds what MapToLevel found to b.color.
void FetchLayer(LayerBatch& b, int begin, int end, const LevelView& level);
// b.rgb += weight * rgb
void AddConstant(LayerBatch& b, int begin, int end, const float* weight, const float* rgb);
// b.scale = b.alpha / (255 b.sum), 0 where there is nothing.
void ScaleBySum(LayerBatch& b);
// RGBA of the batch: b.color (or b.rgb) times b.scale, and b.alpha.
void StoreColors(const LayerBatch& b, float* rgba);
void StoreConstants(const LayerBatch& b, float* rgba);

}  // namespace lumi
