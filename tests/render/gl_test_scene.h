// A small world whose every photograph is known: a textured floor and a box on it, seen by cameras on an arc. And what
// the tests of the graphics backend do with one: show it, draw it, read weights off it, compare pictures.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/gl/egl_context.h"
#include "render/gl/gl_lumigraph.h"
#include "render/photos/photo_set.h"
#include "scene/files/image_io.h"
#include "scene/geometry/mesh.h"
#include "scene/model/scene.h"
#include "scene/program/error.h"

namespace lumi::test {

struct World {
  Scene scene;
  Mesh proxy;
  std::vector<Photo> photos;
};

struct Box {
  Eigen::Vector3d lo{-0.5, -0.4, 0.0}, hi{0.5, 0.4, 0.7};
};

// z is up; the floor is z = 0, a square of half width kFloor.
constexpr double kFloor = 6.0;

inline Eigen::Vector3d WorldColor(const Eigen::Vector3d& x) {
  const auto wave = [](double a) { return 0.5 + 0.5 * std::sin(a); };
  return {wave(5.1 * x.x() + 1.3 * x.z()) * 0.8 + 0.1, wave(4.3 * x.y() - 2.0 * x.z() + 0.7) * 0.8 + 0.1,
          wave(3.1 * (x.x() + x.y()) + 5.0 * x.z()) * 0.8 + 0.1};
}

inline std::optional<Eigen::Vector3d> Hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  double best = std::numeric_limits<double>::infinity();
  if (direction.z() < 0) {
    const double t = -origin.z() / direction.z();
    const Eigen::Vector3d x = origin + t * direction;
    if (std::abs(x.x()) <= kFloor && std::abs(x.y()) <= kFloor) best = t;
  }
  const Box box;
  double enter = 0, leave = best;
  for (int i = 0; i < 3; ++i) {
    const double a = (box.lo[i] - origin[i]) / direction[i], b = (box.hi[i] - origin[i]) / direction[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (enter < leave && enter > 0) best = enter;
  if (!std::isfinite(best)) return std::nullopt;
  return origin + best * direction;
}

inline Image8 Photograph(const RenderView& view) {
  Image8 image(view.size_px.x(), view.size_px.y(), 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      if (const auto direction = RayDirection(view.P, {x + 0.5, y + 0.5}))
        if (const auto hit = Hit(view.centre, direction->normalized()))
          for (int c = 0; c < 3; ++c)
            image.At(x, y, c) = static_cast<std::uint8_t>(std::lround(255 * WorldColor(*hit)[c]));
  return image;
}

inline void AddQuad(Mesh& mesh, const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                    const Eigen::Vector3d& d) {
  const auto n = static_cast<std::int32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {a, b, c, d});
  mesh.faces.push_back({n, n + 1, n + 2});
  mesh.faces.push_back({n, n + 2, n + 3});
}

inline Mesh WorldMesh() {
  Mesh m;
  AddQuad(m, {-kFloor, -kFloor, 0}, {kFloor, -kFloor, 0}, {kFloor, kFloor, 0}, {-kFloor, kFloor, 0});
  const Eigen::Vector3d l = Box().lo, h = Box().hi;
  AddQuad(m, {l.x(), l.y(), h.z()}, {h.x(), l.y(), h.z()}, {h.x(), h.y(), h.z()}, {l.x(), h.y(), h.z()});
  AddQuad(m, {l.x(), l.y(), l.z()}, {h.x(), l.y(), l.z()}, {h.x(), l.y(), h.z()}, {l.x(), l.y(), h.z()});
  AddQuad(m, {h.x(), h.y(), l.z()}, {l.x(), h.y(), l.z()}, {l.x(), h.y(), h.z()}, {h.x(), h.y(), h.z()});
  AddQuad(m, {l.x(), h.y(), l.z()}, {l.x(), l.y(), l.z()}, {l.x(), l.y(), h.z()}, {l.x(), h.y(), h.z()});
  AddQuad(m, {h.x(), l.y(), l.z()}, {h.x(), h.y(), l.z()}, {h.x(), h.y(), h.z()}, {h.x(), l.y(), h.z()});
  return m;
}

inline Eigen::Vector3d ArcCentre(double turn) {
  return {3.2 * std::cos(turn), 3.2 * std::sin(turn), 1.6 + 0.5 * std::sin(3 * turn)};
}

// `turn`: around the box, radians.
inline RenderView ArcView(double turn, int width, int height, double focal_px, double distance = 1.0) {
  const Eigen::Vector3d target(0, 0, 0.3);
  const Eigen::Vector3d eye = target + distance * (ArcCentre(turn) - target);
  return MakeRenderView(Camera::Pinhole(width, height, focal_px, focal_px, 0.5 * width + 1.7, 0.5 * height - 2.1),
                        LookAt(eye, target, Eigen::Vector3d::UnitZ()));
}

// Photos of two sizes, a third of them portrait.
inline World MakeWorld(int views = 10, int side_px = 160, double arc_rad = 2.4) {
  World w;
  w.proxy = WorldMesh();
  const double f = 1.1 * side_px;
  w.scene.cameras = {Camera::Pinhole(side_px, side_px * 3 / 4, f, f, 0.5 * side_px, 0.375 * side_px),
                     Camera::Pinhole(side_px * 3 / 4 - 3, side_px - 5, f, 1.02 * f, 0.37 * side_px, 0.5 * side_px)};
  for (int i = 0; i < views; ++i) {
    View v;
    v.name = std::to_string(100000 + i) + ".png";
    v.camera = CameraId{i % 3 == 2 ? 1 : 0};
    const double turn = arc_rad * i / std::max(1, views - 1);
    v.cam_from_world =
        LookAt(ArcCentre(turn), {0.1 * std::sin(9.0 * i), 0.1 * std::cos(7.0 * i), 0.3}, Eigen::Vector3d::UnitZ());
    w.scene.views.push_back(v);
  }
  UpdateFrameOfReference(w.scene);
  return w;
}

inline void Photograph(World& w) {
  w.photos.clear();
  for (const View& v : w.scene.views) w.photos.push_back({BuildPyramid(Photograph(MakeRenderView(w.scene, v))), 0});
}

inline World Photographed(int views, int side_px, double arc_rad = 2.4) {
  World w = MakeWorld(views, side_px, arc_rad);
  Photograph(w);
  return w;
}

// Every photo of another size and aspect, focal length and centre.
inline World WorldOfManySizes(int views) {
  World w = MakeWorld(views, 60);
  w.scene.cameras.clear();
  for (int i = 0; i < views; ++i) {
    w.scene.cameras.push_back(Camera::Pinhole(40 + 3 * i, 90 - i, 50 + i, 50 + i, 20 + 1.5 * i, 45 - 0.5 * i));
    w.scene.views[static_cast<std::size_t>(i)].camera = CameraId{i};
  }
  UpdateFrameOfReference(w.scene);
  Photograph(w);
  return w;
}

// Every photo one colour: rgb(i), code values.
template <typename Colors>
void Paint(World& w, const Colors& rgb) {
  w.photos.clear();
  for (std::size_t i = 0; i < w.scene.views.size(); ++i) {
    const Camera& c = w.scene.CameraOf(w.scene.views[i]);
    const std::array<std::uint8_t, 3> color = rgb(i);
    Image8 image(c.width_px, c.height_px, 3);
    for (std::size_t n = 0; n < image.data.size(); ++n) image.data[n] = color[n % 3];
    w.photos.push_back({BuildPyramid(image), 0});
  }
}

inline double PsnrDb(const ImageF& a, const ImageF& b) {
  EXPECT_EQ(a.data.size(), b.data.size());
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    const double d = static_cast<double>(a.data[i]) - static_cast<double>(b.data[i]);
    sum += d * d;
  }
  return -10 * std::log10(std::max(sum / static_cast<double>(a.data.size()), 1e-12));
}

inline void ExpectFinite(const ImageF& image) {
  for (const float v : image.data) ASSERT_TRUE(std::isfinite(v) && v >= 0 && v <= 1.0F + 1e-5F) << v;
}

// A world in graphics memory, in a context of its own. Skips where there is no OpenGL 4.3.
class GlTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      context_ = std::make_unique<EglContext>();
      current_ = std::make_unique<EglContext::Current>(*context_);
    } catch (const MachineError& e) {
      GTEST_SKIP() << "OpenGL 4.3 is not available: " << e.what();
    }
    target_ = std::make_unique<GlTarget>();
  }
  void TearDown() override {
    lumigraph_.reset();
    target_.reset();
    current_.reset();
  }

  // A world without photos can be drawn in false colours.
  void Load(World world) {
    world_ = std::move(world);
    std::vector<Eigen::Vector2i> sizes(world_.scene.views.size(), Eigen::Vector2i(1, 1));
    for (std::size_t i = 0; i < world_.photos.size(); ++i)
      sizes[i] = {world_.photos[i].levels[0].width, world_.photos[i].levels[0].height};
    lumigraph_ = std::make_unique<GlLumigraph>(MakeSources(world_.scene), sizes);
    lumigraph_->SetProxy(world_.proxy);
    for (std::size_t i = 0; i < world_.photos.size(); ++i) lumigraph_->Upload({static_cast<int>(i)}, world_.photos[i]);
  }
  ViewSetup SetupOf(const RenderRequest& r) const {
    return MakeViewSetup(lumigraph_->sources(), r.view, r.settings, r.use);
  }
  ImageF Draw(const RenderRequest& request) {
    lumigraph_->Begin(request, *target_);
    return Blend(request);
  }
  template <typename Plan>
  ImageF Draw(const RenderRequest& request, const Plan& plan) {
    lumigraph_->Begin(request, plan, *target_);
    return Blend(request);
  }
  // Weight of every camera at every pixel, times alpha, and alpha: three cameras a picture as red, green and blue.
  std::vector<ImageF> WeightPictures(RenderRequest request) {
    request.show = Show::kFalseColor;
    std::vector<ImageF> pictures;
    for (std::size_t first = 0; first < world_.scene.views.size(); first += 3) {
      std::vector<Eigen::Vector3f> colors(world_.scene.views.size(), Eigen::Vector3f::Zero());
      for (std::size_t i = 0; i < 3 && first + i < colors.size(); ++i) colors[first + i][static_cast<int>(i)] = 1;
      lumigraph_->SetSourceColors(colors);
      pictures.push_back(Draw(request));
    }
    return pictures;
  }

  std::unique_ptr<EglContext> context_;
  std::unique_ptr<EglContext::Current> current_;
  World world_;
  std::unique_ptr<GlLumigraph> lumigraph_;
  std::unique_ptr<GlTarget> target_;

 private:
  ImageF Blend(const RenderRequest& request) {
    lumigraph_->Blend(*target_, 0, request.view.size_px.y());
    return lumigraph_->ReadColor(*target_, request.view.size_px);
  }
};

}  // namespace lumi::test
