// A proxy of its own for each picture (thesis sec. 6.2.3): structure points triangulated in the virtual view. It needs no mesh, in any
// frame of the world, and it is the proxy of scenes that have points but no metric.
//
// Beside it what else is the picture's own: the photos taken around its moment (sec. 6.4.3), whose points are the ones in view, and, in
// a scene without a metric, the world in which angles are those of vanishing points (vanishing_point.h).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "render/radiance/sources.h"
#include "render/world/renderer.h"
#include "scene/view_triangulation/view_triangulation.h"

namespace lumi {

constexpr const char* kPerViewProxy = "per-view";  // as the name of a proxy on the command line

// The photos in the order of their times.
class PhotoOrder {
 public:
  // By time where all photos carry one, else by the frame of the video, else by name.
  explicit PhotoOrder(const Scene& scene);
  int count() const { return static_cast<int>(views_.size()); }
  int view(int rank) const { return views_[static_cast<std::size_t>(rank)]; }
  // The photo that a picture of this moment is of: the nearest in time.
  int RankAt(double time_s) const;
  // Ranks [first, last] of the photos at most `reach` to either side of a moment; all of them where reach < 0 or there is no moment.
  std::pair<int, int> Around(std::optional<double> time_s, int reach) const;

 private:
  std::vector<int> views_;
  std::vector<double> times_;  // of the same, ascending
};

// From one photo to the next where nothing says: as a video's frames.
constexpr double kAssumedFrame_s = 1.0 / 30;
// Photos that carry no time get one, in their order: what happened around a moment is a matter of order.
void GiveTimes(Scene& scene);

struct PerViewOptions {
  ViewTriangulationOptions triangulation;
  double nominal_focal_px = 0;  // of a scene without a metric; 0: NominalFocalPx(of the view)
};

// All that one picture is made of.
struct PictureWorld {
  std::vector<std::int32_t> photos;  // views of the scene that may be blended, in the order of time
  Sources sources;                   // of each, in the world that the picture is rendered in
  std::vector<bool> use;             // one a photo: false where its centre lies at or beyond the plane at infinity
  RenderView view;                   // in the same world, as
  Mesh proxy;                        // this
};

class PerViewProxy {
 public:
  // `scene` must outlive it; its photos' gains and times are read with each picture. Throws DataError for a scene without a point that
  // can be trusted, and for one of matrices without a plane at infinity.
  explicit PerViewProxy(const Scene& scene, const PerViewOptions& options = {});
  // `reach`: photos to either side in time, -1: all of them. The structure points are those that these photos see (all, where they see
  // none). Throws DataError for a view whose centre lies on the plane at infinity.
  PictureWorld For(const RenderView& view, int reach = -1) const;
  std::size_t points() const { return points_.size(); }
  const PhotoOrder& order() const { return order_; }

 private:
  std::vector<Eigen::Vector4d> PointsOf(std::pair<int, int> ranks) const;

  const Scene& scene_;
  PerViewOptions options_;
  PhotoOrder order_;
  std::vector<Eigen::Vector4d> points_;                // trusted, the best first
  std::vector<std::vector<std::int32_t>> seen_;        // by each view of the scene, into points_
  std::optional<Plane> plane_at_infinity_;
};

// How a picture uses the photos around its moment, where nobody `decided` otherwise: 5 to either side where the scene is a video's or the
// picture is of a path of matrices (frame and photo go together), else all. Photos get times, time counts from the middle of the window
// on, fields of view are looked at, and along a path a photo gives way before it ends. Returns the reach, -1: all.
int TakeWindow(Scene& scene, std::optional<int> wanted, bool along_path, std::set<std::string>& decided, RadianceSettings& settings);

// Pixels that no photo of the window sees.
struct BorderOptions {
  bool fill = false;   // from photos farther away in time, as far as
  int reach = 30;      // so many to either side; what none of them sees is filled smoothly from around it
};

// What was seen of the last picture, shares of its pixels.
struct PictureCoverage {
  double window = 0;  // by photos of the window
  double wider = 0;   // by those farther away, too; the rest is filled smoothly, or left a hole
};

class PerViewRenderer : public Renderer {
 public:
  // Photos to either side in time of those that a picture may be made of; -1: all.
  virtual void SetReach(int reach) = 0;
  virtual PictureCoverage Coverage() const = 0;
};

// Renders each picture in its own world from its own proxy, request.view and request.use being the scene's; nothing hides anything:
// what a photo sees of a surface that was made for another view is not known. Photos are read when a picture wants them; where all are of
// one size, no more are kept than the largest reach has. `proxy` and its scene must outlive it. Statistics::plan_ms has the triangulation
// in it. `make`: MakeCpuRenderer or MakeGlRenderer.
using RendererMaker = std::unique_ptr<Renderer> (*)(const Scene&, const Mesh&, const std::vector<Photo>&);
std::unique_ptr<PerViewRenderer> MakePerViewRenderer(const Scene& scene, const PerViewProxy& proxy, RendererMaker make, int reach,
                                                     const BorderOptions& border = {});

}  // namespace lumi
