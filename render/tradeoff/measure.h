// Held-out views to measure on, and the time of a frame.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "render/world/renderer.h"
#include "scene/geometry/median.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"

namespace lumi {

constexpr double kSlowMs = 2000;  // a frame that takes longer is timed once

struct TestView {
  std::string name;  // of the photo
  ViewId id;
  RenderView view;        // at the measured size
  std::vector<bool> use;  // which photos may be blended
  Image8 photo;           // at the measured size
};

// A view's own photo and camera at `width_px` (0, or above the photo's: its own size). `use` is left empty.
TestView TestViewOf(const Scene& scene, ViewId id, int width_px);

// The largest n, at most this one and at least 2, whose fold holds a photo; 2 where none does.
int HoldoutWithPhotos(const Scene& scene, int n, Fold fold);

// At most `most` photos of a fold, evenly spread over it, at `width_px` (0, or above the photo's: its own size). None
// of the fold may be used; for the choosing fold, nor any of the reporting one where that leaves half of the photos. N
// is lowered until the fold holds a photo (HoldoutWithPhotos). Throws DataError where nothing is left to render from.
std::vector<TestView> HeldOutViews(const Scene& scene, int n, Fold fold, int most, int width_px);

// A quad that faces the mean viewing direction, `times` the median depth of the points away.
Mesh FacingPlane(const Scene& scene, double times);
constexpr double kAtInfinity = 1000;  // times the median depth: no visible parallax

struct TimedFrame {
  ImageF image;
  double first_ms = 0;
  double ms = 0;  // median of the repeats, or the first
  std::vector<double> all_ms;
};

// Renders one frame to warm up (textures, visibility maps, caches), then `repeats` timed ones. If a frame takes more
// than two seconds, it is timed only once after the warm-up; if it takes more than `alone_ms`, it is not repeated and
// its first time counts.
TimedFrame TimeFrame(Renderer& renderer, const RenderRequest& request, int repeats, double alone_ms = 4000);

// The first frame of a camera path at this width, its height by the path's own size, else by the scene's first camera;
// at the scene's first moment.
RenderView FirstOfPath(const Scene& scene, const std::filesystem::path& file, int width_px);

}  // namespace lumi
