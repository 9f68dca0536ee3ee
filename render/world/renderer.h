// What the two backends have in common: a view in, a picture out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "render/photos/photo_cache.h"
#include "render/photos/photo_set.h"
#include "render/picture/source_color.h"
#include "render/radiance/optimum/optimum.h"
#include "render/radiance/settings.h"
#include "render/world/picture_world.h"
#include "scene/model/image.h"

namespace lumi {

// The longest side of a picture that is asked for on a command line.
constexpr int kMaxPictureSide = 32768;

enum class Show {
  kColor,
  kFalseColor,    // one distinct colour a source view (SourceColor), blended with the same weights
  kTessellation,  // the colour with the sparse samples' triangles or cells, and the epipole samples, drawn over it
};

// Of the last picture.
struct RenderStatistics {
  double plan_ms = 0, blend_ms = 0;  // 0 where the two are one (a weight a pixel)
  double bring_ms = 0;               // reading photos that were not in memory (PhotoSupply)
  int halved = 0;               // the most often that photos of the picture were halved, for lack of graphics memory
  std::size_t photo_bytes = 0;  // of the photos in graphics memory, where not all of them are
  long samples = 0;             // rays at which weights were computed; 0: every pixel
  long triangles = 0;
  OptimumCounts optimum;
  double window_coverage = 0;  // shares of the pixels that are seen by photos of the picture's window in time ...
  double wider_coverage =
      0;  // ... and by those farther away, too (BorderOptions); the rest is filled smoothly, or a hole
};

struct RenderRequest {
  RenderView view;  // in world
  RadianceSettings settings;
  std::vector<bool> use;  // empty: all photos; else one a view of the scene, false: left out
  Show show = Show::kColor;
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  // RGBA, [0,1], premultiplied: a hole is (0,0,0,0). Not thread-safe: parallel inside.
  virtual ImageF Render(const RenderRequest& request) = 0;
  virtual std::string Device() const = 0;  // "2 cores, AVX-512" or GL_RENDERER
  virtual RenderStatistics Statistics() const { return {}; }
};

// How a renderer gets photos that are not all in memory.
struct PhotoSupply {
  // Brings these into the vector of photos that the renderer was made with, as PhotoCache::Bring; others may go.
  std::function<int(std::span<const WantedPhoto>)> bring;
  int coarsest = 0;                // halvings that bring() makes use of
  std::size_t at_once_bytes = 0;   // of photos with their pyramids that it can bring without halving them
  std::size_t graphics_bytes = 0;  // that photos may take in graphics memory
  int small_halvings = -1;         // of the small copies that the vector begins with; -1: there are none
};

// Blends the pictures of one world after another. A request's view is in the world, and `use` has one entry a camera of
// it.
class WorldRenderer : public Renderer {
 public:
  // Sets the world from the next picture on, with as many cameras as before. If a camera now belongs to another view,
  // its place in the photo vector that the renderer was made with holds that view's photo, of the camera's size.
  virtual void Enter(std::shared_ptr<const PictureWorld> world) = 0;
};

// photos: one a camera of the world, those without levels may come later. They must outlive the renderer. supply: where
// not all photos are held, those that a picture is blended from are brought before it is blended.
using WorldRendererMaker = std::unique_ptr<WorldRenderer> (*)(std::shared_ptr<const PictureWorld> world,
                                                              const std::vector<Photo>& photos, PhotoSupply supply);
std::unique_ptr<WorldRenderer> MakeCpuRenderer(std::shared_ptr<const PictureWorld> world,
                                               const std::vector<Photo>& photos, PhotoSupply supply = {});
// Offscreen through EGL (no window system needed). Throws MachineError where OpenGL 4.3 core cannot be had.
std::unique_ptr<WorldRenderer> MakeGlRenderer(std::shared_ptr<const PictureWorld> world,
                                              const std::vector<Photo>& photos, PhotoSupply supply = {});
// In the context that is current, now and at every call, its destruction included: a window's.
std::unique_ptr<WorldRenderer> MakeGlRendererHere(std::shared_ptr<const PictureWorld> world,
                                                  const std::vector<Photo>& photos, PhotoSupply supply = {});
// Throws UsageError for what OpenGL does not draw: the optimum at every pixel.
void RequireDrawnByGl(const RadianceSettings& settings);

}  // namespace lumi
