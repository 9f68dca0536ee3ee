// What is handed out as true, against closed forms and against what is rendered.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "simulate/shapes.h"
#include "simulate/surface_points.h"
#include "tests/simulate/small_scene.h"

namespace lumi {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Vertices and depths are stored as float: a few of its units, relative.
constexpr double kFloat = 5e-7;

TEST(Truth, DepthOfAPlaneIsTheClosedForm) {
  const SmallScene scene(R"({
    "cameras": [{"size": [64, 48], "fov_deg": 55}],
    "path": {"kind": "poses", "poses": [{"eye": [0.3, -3, 2], "target": [0, 0, 0]}]},
    "materials": [{"name": "m"}],
    "objects": [{"kind": "quad", "size": [100, 100], "rotate_deg": [20, 10, 30], "position": [0, 0, -0.4], "material": "m"}]})");
  const RenderedView view = scene.Render();
  const Eigen::Affine3d& placed = scene.description.objects[0].world_from_object;
  const Vector3d n = placed.linear().col(2);
  const double d = n.dot(placed.translation());
  const Vector3d axis = scene.renderer.CameraOf(scene.views[0]).cam_from_world.R().row(2);
  int seen = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const Ray ray = scene.RayThrough(0, {x + 0.5, y + 0.5});
      const double t = (d - n.dot(ray.origin)) / n.dot(ray.direction);
      if (t <= 0 || t > 40) continue;
      ++seen;
      const double depth = t * axis.dot(ray.direction);
      // Rounding the plane's far corners (100 units away) to float tilts it by about float's unit.
      ASSERT_NEAR(view.depth.At(x, y, 0), depth, 20 * kFloat * depth) << x << " " << y;
    }
  EXPECT_GT(seen, 2000);
}

TEST(Truth, DepthAndSilhouetteOfASphereAreTheClosedForm) {
  constexpr double kRadius = 0.8, kSegments = 1024;
  const SmallScene scene(R"({
    "cameras": [{"size": [80, 60], "fov_deg": 40}],
    "path": {"kind": "poses", "poses": [{"eye": [1, -3, 1.5], "target": [0.1, 0, 0.1]}]},
    "materials": [{"name": "m"}],
    "objects": [{"kind": "sphere", "radius": 0.8, "segments": 1024, "material": "m"},
                {"kind": "quad", "size": [50, 50], "position": [0, 0, -5], "material": "m"}]})");
  // The polyhedron is inscribed: at most so far below the sphere, half a segment either way.
  const double sagitta = kRadius * (1 - std::pow(std::cos(3.14159265358979 / kSegments), 2));
  const RenderedView view = scene.Render();
  const Vector3d axis = scene.renderer.CameraOf(scene.views[0]).cam_from_world.R().row(2);
  int inside = 0, outside = 0;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x) {
      const Ray ray = scene.RayThrough(0, {x + 0.5, y + 0.5});
      const double along = -ray.origin.dot(ray.direction);
      const double distance = (ray.origin + along * ray.direction).norm();
      if (distance > kRadius) {
        ASSERT_EQ(view.silhouette.At(x, y, 0), 0) << x << " " << y;
        ++outside;
      } else if (distance < kRadius - 2 * sagitta) {
        ASSERT_EQ(view.silhouette.At(x, y, 0), 255) << x << " " << y;
        ++inside;
        const double half_chord = std::sqrt(kRadius * kRadius - distance * distance);
        const double facing = half_chord / kRadius;
        if (facing < 0.2) continue;
        const double depth = (along - half_chord) * axis.dot(ray.direction);
        ASSERT_NEAR(view.depth.At(x, y, 0), depth, sagitta / facing + kFloat * depth) << x << " " << y;
      }
    }
  EXPECT_GT(inside, 500);
  EXPECT_GT(outside, 500);
}

class TruthOfCamera : public ::testing::TestWithParam<const char*> {};

TEST_P(TruthOfCamera, PointsProjectOntoTheSurfaceAndItsColour) {
  const SmallScene scene(std::string(R"({"cameras": [{"size": [160, 120], )") + GetParam() + R"(}],
    "path": {"kind": "ring", "views": 5, "radius": 3, "height": 1.5, "arc_deg": 70, "start_deg": -120},
    "materials": [{"name": "m", "texture": {"kind": "noise", "size": 0.9, "octaves": 2, "colors": ["#804020", "#e0d0a0"]}}],
    "objects": [{"kind": "heightfield", "size": [5, 5, 0.2], "material": "m", "segments": 40},
                {"kind": "cylinder", "radius": 0.4, "height": 1, "material": "m"},
                {"kind": "box", "size": [0.6, 0.7, 0.5], "position": [0.9, 0.2, 0.3], "rotate_deg": [10, 20, 30], "material": "m"}],
    "lights": [{"towards": [0.3, -0.5, 1]}]})");
  long rays = 0;
  const auto points = SampleSurfacePoints({scene.description, scene.tracer, scene.shader, scene.renderer}, scene.views,
                                          300, 1, SilentProgress(), rays);
  ASSERT_EQ(points.size(), 300u);
  std::vector<RenderedView> photos;
  for (std::size_t i = 0; i < scene.views.size(); ++i) photos.push_back(scene.Render(i));
  std::vector<int> colour_errors;
  for (const Point& point : points) {
    ASSERT_GE(point.track.size(), 2u);
    for (const Observation& seen : point.track) {
      const auto view = static_cast<std::size_t>(seen.view.value);
      const TrueCamera truth = scene.renderer.CameraOf(scene.views[view]);
      const auto x_px = truth.camera.Project(truth.cam_from_world * point.x_in_world);
      ASSERT_TRUE(x_px);
      EXPECT_LT((*x_px - seen.x_px).norm(), 1e-9);
      const auto hit = scene.tracer.Trace(scene.RayThrough(view, seen.x_px), {});
      ASSERT_TRUE(hit);
      EXPECT_LT((hit->x_in_world - point.x_in_world).norm(), 1e-5);
      const int x = static_cast<int>(seen.x_px.x()), y = static_cast<int>(seen.x_px.y());
      for (int c = 0; c < 3; ++c)
        colour_errors.push_back(std::abs(photos[view].photo.At(x, y, c) - point.color[static_cast<std::size_t>(c)]));
    }
  }
  // A pixel averages over an edge or a slope here and there: nine in ten agree to a few code values.
  const auto tenth = colour_errors.begin() + static_cast<std::ptrdiff_t>(colour_errors.size() * 9 / 10);
  std::nth_element(colour_errors.begin(), tenth, colour_errors.end());
  EXPECT_LE(*tenth, 8);
}

INSTANTIATE_TEST_SUITE_P(
    Models, TruthOfCamera,
    ::testing::Values(R"("fov_deg": 50)", R"("model": "SIMPLE_RADIAL", "fov_deg": 60, "distortion": [-0.12])",
                      R"("model": "OPENCV", "fov_deg": 60, "distortion": [-0.15, 0.03, 0.001, -0.002])",
                      R"("model": "OPENCV_FISHEYE", "fov_deg": 110, "distortion": [0.01, -0.002, 0, 0])"));

TEST(Truth, ShapesAreClosedAndFaceOutwards) {
  const SmallScene scene(R"({
    "cameras": [{"size": [8, 6], "fov_deg": 50}], "path": {"kind": "poses", "poses": [{"eye": [0, -9, 0], "target": [0, 0, 0]}]},
    "materials": [{"name": "m"}],
    "objects": [{"kind": "box", "size": [1, 2, 3], "material": "m"}, {"kind": "sphere", "radius": 1, "material": "m", "segments": 24},
                {"kind": "cylinder", "radius": 1, "height": 2, "material": "m"},
                {"kind": "cylinder", "radius": 1, "top_radius": 0, "height": 2, "material": "m"},
                {"kind": "loft", "sections": [{"centre": [0, 0, 0], "half_size": [1, 0.5]}, {"centre": [0.2, 0, 1], "half_size": [0.4, 0.7]},
                  {"centre": [0, 0, 2]}], "up": [0, 1, 0], "material": "m"}]})");
  for (const ObjectDescription& object : scene.description.objects) {
    const Mesh mesh = Welded(Tessellate(object));
    EXPECT_TRUE(IsClosed(mesh)) << static_cast<int>(object.kind);
    double volume = 0;  // positive where the faces look outwards
    for (const auto& f : mesh.faces)
      volume += mesh.vertices[static_cast<std::size_t>(f[0])].dot(mesh.vertices[static_cast<std::size_t>(f[1])].cross(
                    mesh.vertices[static_cast<std::size_t>(f[2])])) /
                6;
    EXPECT_GT(volume, 0.5) << static_cast<int>(object.kind);
  }
  EXPECT_FALSE(Validate(scene.tracer.TrueMesh()));
}

}  // namespace
}  // namespace lumi
