// What an unstructured lumigraph is: photographs, their cameras, and sparse structure. The proxy is a Mesh in
// proxies/NAME.ply beside it. Value types; files live in scene/files.
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/geometry/projection.h"
#include "scene/geometry/rigid3.h"
#include "scene/geometry/similarity3.h"
#include "scene/model/camera.h"
#include "scene/model/photo_correction.h"
#include "scene/model/photo_grid.h"

namespace lumi {

// Positions in Scene's vectors. Distinct types, so that one cannot stand for another.
template <typename Tag>
struct Index {
  std::int32_t value = -1;
  friend auto operator<=>(const Index&, const Index&) = default;
};
using CameraId = Index<struct CameraTag>;
using ViewId = Index<struct ViewTag>;
using PointId = Index<struct PointTag>;

enum class Frame {
  kMetric,       // cameras + cam_from_world (up to one similarity)
  kQuasiAffine,  // P, with the plane at infinity outside the scene's hull
  kProjective,   // P, up to one projective transformation
};
std::string_view Name(Frame frame);
std::optional<Frame> FrameFromName(std::string_view name);

// One photograph with its camera.
struct View {
  std::string name;                 // path relative to Scene::image_folder, as COLMAP names it ("a/b.jpg")
  CameraId camera;                  // into Scene::cameras (metric frames)
  Rigid3 cam_from_world;            // metric frames
  Matrix34d P = Matrix34d::Zero();  // other frames: pixels from world, w > 0 in front
  Eigen::Vector2i size_px =
      Eigen::Vector2i::Zero();  // other frames: the photo's (metric ones: the camera's, see SizePx)
  std::optional<double> time_s;
  std::optional<int> frame_index;                     // in the video it came from
  int orientation = 1;                                // EXIF's, 1 to 8: which side of the stored pixels is up
  double gain = 1.0;                                  // this photo's exposure relative to the scene's
  std::shared_ptr<const PhotoGrids> grids;            // what was read off its pixels; nullptr: nothing
  std::shared_ptr<const PhotoCorrection> correction;  // to apply to its pixels when they are read; nullptr: none

  Eigen::Vector3d CentreInWorld() const { return cam_from_world.OriginInSource(); }
};

struct Observation {
  ViewId view;
  Eigen::Vector2d x_px = Eigen::Vector2d::Zero();
};

struct Point {
  Eigen::Vector3d x_in_world = Eigen::Vector3d::Zero();  // metric frames
  // Other frames: homogeneous, signed so that P X has w > 0 in the views that see it; quasi-affine ones: its own w > 0.
  Eigen::Vector4d X_in_world = Eigen::Vector4d::Zero();
  std::array<std::uint8_t, 3> color{};  // RGB
  double error_px = 0;                  // mean reprojection error
  std::vector<Observation> track;
};

struct Scene {
  Frame frame = Frame::kMetric;
  std::vector<Camera> cameras;
  std::vector<View> views;  // sorted by name
  std::vector<Point> points;
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();    // unit, in world: against gravity, from the photos' own up
  Similarity3 normalized_from_world;                 // moves the scene to its centre, size about 1: before any float
  std::optional<Eigen::Vector4d> plane_at_infinity;  // other frames, where it is known or estimated: (n, d) in world
  std::optional<double> period_s;
  std::optional<double> metres_per_unit;  // of the world frame, where it was measured
  std::string active_proxy;               // name in proxies/, or empty

  std::filesystem::path folder;        // where it was read from; relative paths below are resolved against it
  std::filesystem::path image_folder;  // photos, absolute or relative to the working directory

  const Camera& CameraOf(const View& view) const { return cameras[static_cast<std::size_t>(view.camera.value)]; }
  std::filesystem::path ImagePath(const View& view) const { return image_folder / view.name; }
};

// What the renderer reads of a view, metric or not.
struct RenderView {
  Matrix34d P = Matrix34d::Zero();                   // pixels from world, w > 0 in front
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // centre of projection in world
  Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
  std::optional<double> time_s;
  double gain = 1.0;
  std::shared_ptr<const PhotoGrids> grids;
  std::shared_ptr<const PhotoCorrection> correction;  // of a picture that is to look as this photo does; nullptr: none
};
// A metric view's camera must be a pinhole (photos are undistorted when a scene is made): throws std::invalid_argument
// otherwise. In other frames the centre comes from P: throws DataError where it lies at infinity.
RenderView MakeRenderView(const Scene& scene, const View& view);
RenderView MakeRenderView(const Camera& pinhole, const Rigid3& cam_from_world);

// Of a view's photo, in any frame.
Eigen::Vector2i SizePx(const Scene& scene, const View& view);

// To be called first by whatever needs cameras and poses: throws DataError where the scene has projection matrices
// only. what: who needs them, "lumi-proxy" or "a fly-through".
void RequireMetric(const Scene& scene, std::string_view what);

// Sets up (the robust mean of the photos' own up) and normalized_from_world (robust centre and size of the points and
// cameras). Call after cameras, poses or points changed. Frames that are not metric have no up: it stays as it is.
void UpdateFrameOfReference(Scene& scene);

// Depth of a view's own points along its z axis (positive ones, ascending): what near and far mean for it. Metric
// frames only.
std::vector<double> PointDepths(const Scene& scene, ViewId view);

// A scene in another world frame; photos stay what they are. Metric frames only.
void Transform(Scene& scene, const Similarity3& target_from_world);

// Views 0, N, 2N ... (sorted by name) are the fold that quality is reported on; N/2, N/2 + N ... the one that anything
// is chosen on. N >= 2.
enum class Fold { kReport, kChoose };
std::vector<ViewId> FoldViews(const Scene& scene, int n, Fold fold);

}  // namespace lumi
