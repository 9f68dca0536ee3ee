// PatchMatch stereo: at each pixel of a photo the plane through which its patch matches other photos best. Planes
// spread to neighbours and are varied at random (Barnes et al. 2009; Bleyer, Rhemann & Rother 2011), the pixels of a
// checkerboard's colour all at once (Galliani, Lasinger & Schindler 2015), each from the best of eight regions around
// it, and each weighs the sources by how many of its neighbours' planes they match (Xu & Tao 2019, "Multi-scale
// geometric consistency guided multi-view stereo"). Once the sources have maps of their own, a plane also pays for not
// agreeing with them.
//
// A pixel reads planes of the other colour only, and random numbers come from its place: the result does not depend on
// the number of threads.
#pragma once

#include <cstdint>
#include <vector>

#include "proxy/dense/depth_map.h"
#include "proxy/dense/patch_score.h"
#include "proxy/dense/stereo_camera.h"

namespace lumi {

struct StereoPicture {
  StereoCamera camera;
  Image8 grey;     // of the camera's size
  Image8 ignored;  // the same size, above 127 where a mask says so; empty: nowhere
  Image8 object;   // the same size, above 127 within the silhouette: no patch crosses its outline; empty: there is none
};

struct MatchSource {
  const StereoPicture* picture = nullptr;
  const DepthMap* map = nullptr;  // of the source, of any size; nullptr: not yet
};

struct PatchMatchOptions {
  int iterations = 4;
  std::uint32_t seed = 0;               // of this photo and round
  float nearest_w = 0, farthest_w = 0;  // inverse depths that are tried, nearest_w > farthest_w > 0
  float perturbation = 0.04F;           // share of the inverse depth, halved with each iteration
  float geometric_weight = 0.2F;        // a pixel that a plane lies off the sources' own, up to three
};

// `map` holds where to start from, and then what was found; of the reference's size. At most kMostSources sources.
inline constexpr std::size_t kMostSources = 16;
void MatchPatches(const StereoPicture& reference, const std::vector<MatchSource>& sources,
                  const PatchMatchOptions& options, DepthMap& map);

}  // namespace lumi
