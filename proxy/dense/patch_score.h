// How well a patch of one photo matches another photo through a plane: normalised cross correlation, which a photo's
// exposure does not change, its samples weighed by how near and how alike they are to the patch's middle (Bleyer,
// Rhemann & Rother 2011; bilateral weights after Schoenberger et al. 2016). Sixteen pixels at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "proxy/dense/stereo_camera.h"
#include "scene/model/image.h"
#include "scene/program/registers.h"

namespace lumi {

inline constexpr int kLanes = 16;         // pixels that are scored together
inline constexpr int kPatchSamples = 48;  // 7 x 7 without the middle, two pixels apart
inline constexpr int kPatchRadiusPx = 6;

// A grey photo for fetches between pixels: each entry holds a pixel and its right, lower and lower right neighbours, a
// byte each, so that one fetch of four bytes is enough.
struct QuadImage {
  int width = 0, height = 0;
  std::vector<std::uint32_t> quads;
};
QuadImage PackQuads(const Image8& grey);

// Grey, of the photo's own size.
Image8 GreyOf(const Image8& rgb);

// The reference's side of sixteen patches, which all planes that are tried share.
struct alignas(64) PatchBatch {
  float weight[kPatchSamples][kLanes];  // of a sample; their sum is 1
  float signal[kPatchSamples][kLanes];  // weight times (grey - the patch's weighted mean)
  float deviation[kLanes];              // weighted standard deviation, code values
  float x[kLanes], y[kLanes];           // pixel centres
};
// Around the pixels x[l], y of a grey photo; samples beyond its border repeat the border. `object`: of the same size,
// above 127 within a silhouette, samples beyond whose outline hardly count; or empty.
void MakePatches(const Image8& grey, const int x[kLanes], int y, PatchBatch& out, const Image8& object = {});

// A plane for each of the sixteen pixels.
struct alignas(64) PlaneBatch {
  float w[kLanes], gx[kLanes], gy[kLanes];
};

// 1 - correlation, 0 .. 2. kUnseen where the plane is not in front of the source or its middle is not in the photo; 1
// where either patch is too flat to say anything.
inline constexpr float kUnseen = 2.0F;
inline constexpr float kFlatDeviation = 1.0F;  // code values; noise of a good photo at this size is about as much
// Registers of so many bytes are used, at most WidestRegister(): costs differ by rounding.
void ScorePatches(const PatchBatch& patches, const QuadImage& source, const PairGeometry& pair,
                  const PlaneBatch& planes, float cost[kLanes], int register_bytes = WidestRegister());

}  // namespace lumi
