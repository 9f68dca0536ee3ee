// One photo with its truth: the code that stands for the camera. Effects are entered only where the scene asks for
// them.
#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "scene/geometry/rigid3.h"
#include "scene/model/image.h"
#include "simulate/camera_paths.h"
#include "simulate/shader.h"
#include "simulate/tracer.h"

namespace lumi {

struct RenderedView {
  Image8 photo;       // RGB
  ImageF depth;       // along the camera's z axis at the pixels' centres, world units; 0 where nothing is
  Image8 silhouette;  // one channel, 255 where the nearest surface is an object of the foreground
  // One channel, empty without moving parts: 255 where one of them is seen at some time of the exposure; 128 where one
  // is at another time of the scene's period (ViewRenderer's sweep).
  Image8 moving;
};

// What was done; an effect that is off adds nothing to any of these.
struct TraceCounters {
  long rays = 0;
  long poses = 0;  // of the camera: one a view, more under motion blur and rolling shutter
  long noise_draws = 0;
};

// The true camera of a view: pose at the middle of its exposure.
struct TrueCamera {
  Camera camera;
  double skew_px = 0;
  Rigid3 cam_from_world;
  double gain = 1;                                  // on code values
  std::array<double, 3> white_balance = {1, 1, 1};  // RGB, on code values, beside the gain
};

class ViewRenderer {
 public:
  // width_px: of every photo (0: as described). Throws UsageError.
  // sweep: so many times of the scene's period are looked at for RenderedView::moving.
  ViewRenderer(const SceneDescription& scene, const Tracer& tracer, const Shader& shader, int width_px,
               std::uint64_t seed, int sweep = 0);

  TrueCamera CameraOf(const PlannedView& view) const;
  const EffectsDescription& effects() const { return scene_.effects; }
  // Tiles in parallel. The same on any number of threads.
  RenderedView Render(const PlannedView& view, TraceCounters& counters) const;
  // How far the image of what stands still moves during the exposure, in pixels: the 10th, 50th and 90th percentile
  // over the photo. 0 of a sharp one. `depth`: RenderedView::depth.
  std::array<double, 3> BlurPx(const PlannedView& view, const ImageF& depth) const;

 private:
  struct Moment;  // camera and moving parts while one sample is taken
  double BlurSeconds(const PlannedView& view) const;
  Moment MomentAt(const PlannedView& view, double offset_s, TraceCounters& counters) const;
  using RayThrough = std::function<std::optional<Ray>(const Moment&, const Eigen::Vector2d& x_px)>;
  std::uint8_t MovingAt(const Eigen::Vector2d& x_px, const std::vector<Moment>& moments, const RayThrough& ray_through,
                        long& rays) const;

  const SceneDescription& scene_;
  const Tracer& tracer_;
  const Shader& shader_;
  std::uint64_t seed_;
  std::vector<Camera> cameras_;  // at the size that is rendered
  std::vector<double> skews_px_;
  std::vector<PartPoses> sweep_;
};

// Point on the plane z = 1 seen at a pixel of a camera with skew; nullopt where the lens shows nothing there.
std::optional<Eigen::Vector2d> NormalizedWithSkew(const Camera& camera, double skew_px, const Eigen::Vector2d& x_px);

}  // namespace lumi
