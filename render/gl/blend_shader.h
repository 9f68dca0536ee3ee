// The text of the shaders that draw a lumigraph. The blend shader evaluates the weights of render/radiance/weights.h at
// every pixel; tests in tests/render compare the two. A measure that is switched off is not compiled into a variant.
#pragma once

#include <string>

#include "render/radiance/settings.h"

namespace lumi {

// Mesh positions to clip space: a near plane at kNearDepth and none behind.
const std::string& DepthVertexShader();
// Writes the depth along the optical axis, normalised units; with `faces`, the proxy's face as well, counted from 1.
std::string DepthFragmentShader(bool faces);
// A triangle over the whole viewport.
const std::string& FullScreenVertexShader();

// Which cameras a pixel looks at.
enum class CameraLists {
  kTiles,  // the lists of CullComputeShader; all cameras if there are none
  kCells,  // the lists of a CandidatePlan
};

struct BlendVariant {
  int k = 4;  // 0: all
  bool false_color = false;
  int groups = 1;                   // photo textures
  bool whole_layers = false;        // every photo fills its texture: the sampler clamps to its edge
  bool cameras_in_uniforms = true;  // else in a buffer texture
  int camera_capacity = 1;          // of the uniform block
  CameraLists lists = CameraLists::kTiles;
  Correlation correlation = Correlation::kInverse;
  bool field_of_view = true;
  bool visibility = false;
  MeasureSet terms;                       // the terms of h that depend on the ray
  Resolution stretch = Resolution::kOff;  // how terms that read the stretch compute it
  bool photo_terms = false;               // h has terms that do not depend on the ray
  bool exposure = false;
  bool prefilter = true;
  bool compute = false;  // BlendComputeShader
  auto operator<=>(const BlendVariant&) const = default;
  // Whether the proxy's faces are read: the plane at a pixel.
  bool Faces() const { return stretch == Resolution::kJacobian || prefilter; }
};
std::string BlendFragmentShader(const BlendVariant& variant);
// The same as a compute shader, an invocation a pixel of kBlendGroupPx x kBlendGroupPx, that stores the picture as
// image 0: of rows picture_rows.x to picture_rows.y - 1, of picture_rows.z columns. Server cards have a few units only
// that draw fragments (an H100 4 of 132), and all of them compute.
std::string BlendComputeShader(const BlendVariant& variant);
constexpr int kBlendGroupPx = 8;  // a side; divides kTilePx: in a whole picture a group looks at one list
// Rows of four floats that a camera takes.
int CameraRows(const BlendVariant& variant);

// A compute shader with one invocation per tile: lists the cameras that see anything of the proxy in the tile, sorted
// by the least angle they may have there. A pixel goes through its tile's list until all that follow are farther than
// its k + 1st camera, so it looks at every camera that could matter: the picture is the same with lists and without.
std::string CullComputeShader(const BlendVariant& variant);
constexpr int kTilePx = 16;  // a tile's side
constexpr int kTilesPerGroup = 32;

// Steps of the table of the falling leaves' correlation.
constexpr int kLeafSteps = 4096;

// In normalised units: nothing nearer is drawn.
constexpr float kNearDepth = 1e-5F;

}  // namespace lumi
