// What the two backends have in common: a view in, a picture out.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/photos/photo_set.h"
#include "render/radiance/optimum.h"
#include "render/radiance/settings.h"
#include "render/radiance/sources.h"
#include "scene/geometry/mesh.h"
#include "scene/model/image.h"
#include "scene/model/scene.h"

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
  long samples = 0;                  // rays at which weights were computed; 0: every pixel
  long triangles = 0;
  OptimumCounts optimum;
};

struct RenderRequest {
  RenderView view;                // in world
  RadianceSettings settings;
  std::vector<bool> use;          // empty: all sources; else one a view, false: left out
  Show show = Show::kColor;
};

class Renderer {
 public:
  virtual ~Renderer() = default;
  // RGBA, [0,1], premultiplied: a hole is (0,0,0,0). Not thread-safe: parallel inside.
  virtual ImageF Render(const RenderRequest& request) = 0;
  // Another proxy from the next picture on, which must outlive its use. It hides nothing from any photo: maps of what each photo
  // sees of it would take longer than a frame.
  virtual void ReplaceProxy(const Mesh& proxy) = 0;
  // Other cameras from the next picture on, as many as before, in whatever world: a proxy in that one must follow, and the views are in it.
  virtual void ReplaceCameras(const Sources& cameras) = 0;
  // The photo in this place of the vector that the renderer was made with is another now, or has come, as large as its view says; false
  // colours show it as `color`'s (SourceColor).
  virtual void PhotoReplaced(ViewId place, int color) = 0;
  virtual std::string Device() const = 0;   // "2 cores, AVX-512" or GL_RENDERER
  virtual RenderStatistics Statistics() const { return {}; }
};

// The scene, mesh and photos must outlive the renderer.
std::unique_ptr<Renderer> MakeCpuRenderer(const Scene& scene, const Mesh& proxy, const std::vector<Photo>& photos);
// Offscreen through EGL (no window system needed). Throws MachineError where OpenGL 4.3 core cannot be had.
std::unique_ptr<Renderer> MakeGlRenderer(const Scene& scene, const Mesh& proxy, const std::vector<Photo>& photos);
// In the context that is current, now and at every call, its destruction included: a window's.
std::unique_ptr<Renderer> MakeGlRendererHere(const Scene& scene, const Mesh& proxy, const std::vector<Photo>& photos);
// Throws UsageError for what OpenGL does not draw: the optimum at every pixel.
void RequireDrawnByGl(const RadianceSettings& settings);

// A colour for a source view, distinct from its neighbours' (golden-ratio hues, alternating lightness), RGB [0,1].
Eigen::Vector3f SourceColor(int view_index);

}  // namespace lumi
