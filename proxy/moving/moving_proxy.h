// A surface for what moves. Structure from motion leaves it out (it is masked), so a mesh through the points puts it on
// what stands behind it, and photos of one moment from different places then show it twice. Here its depth is where
// they agree: planes are swept (Collins 1996) over the masked region as one reference camera sees it, photos of one
// moment being compared with one another only, the errors of all moments added up; belief propagation (Felzenszwalb &
// Huttenlocher 2006) makes the depths smooth. One surface serves all moments, as one proxy serves the whole lumigraph:
// at each ray it stands where all moments together are shown with the least error, which is the middle of the path of
// what passes there, or the background where that has more to say.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scene/geometry/mesh.h"
#include "scene/model/image.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

struct MovingOptions {
  int moments = 64;              // at most, spread over the period
  int views_a_moment = 8;        // at most, those farthest apart
  int photo_px = 256;            // longer side of the photos compared, at most
  int grid = 96;                 // samples along the longer side of the region, 8 or more
  int max_depths = 96;           // planes, at most; about one a pixel of parallax
  double nearest = 0.3;          // the first plane, of the distance of the nearest still surface
  double masked_share = 0.5;     // of the photos that see a point: fewer show it masked, and it does not move
  double truncate = 60;          // code values, rms over the channels: photos that differ by more are as wrong as this
  double still_prior = 4;        // squared code values, for a depth 8 planes or more from the still surface
  double smoothness = 6;         // squared code values, between neighbours one plane apart, in proportion up to ...
  double smoothness_planes = 6;  // ... so many
};
std::string Validate(const MovingOptions& options);  // empty, or what is wrong

// A view that takes part, and which photos show the same moment.
struct MomentView {
  ViewId view;
  int moment = 0;
};
// Photos of one moment: a frame apart at most, round the period where the scene has one, in different places. By
// moment. Empty where no two photos are of one moment, or none has a time.
std::vector<MomentView> PickMoments(const Scene& scene, const MovingOptions& options);

struct MovingPhoto {
  RenderView render;  // its size is the photo's
  Image8 photo;       // RGB
  Image8 moves;       // one channel, of the photo's size: above 127 where something moves
  int moment = 0;
};

struct MovingSummary {
  std::size_t photos = 0;
  int moments = 0, depths = 0, columns = 0, rows = 0;
  std::size_t region = 0;                              // samples that something moves at
  std::size_t surface = 0;                             // of them, samples that left the still surface
  double nearest = 0, farthest = 0, median_depth = 0;  // of the surface, along the reference camera's axis; world units
  double gain =
      0;  // by how much less photos of one moment differ on the surface than on the still one, squared code values
};

// `still` with the surface before it, joined to it round its border; faces of `still` that would hide it are gone.
// Throws DataError: nothing is masked; no two photos of one moment; cameras that stand round what moves; a depth that
// no photos agree on better.
Mesh BuildMovingProxy(const std::vector<MovingPhoto>& photos, const Mesh& still, const MovingOptions& options,
                      ProgressSink& progress, MovingSummary* summary = nullptr);

}  // namespace lumi
