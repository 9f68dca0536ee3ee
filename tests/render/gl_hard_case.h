// Scenes and views where geometry degenerates, every way of weighing them, and what holds of OpenGL's pictures of them.
#pragma once

#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "render/picture/source_color.h"
#include "render/world/renderer.h"
#include "tests/render/gl_test_scene.h"

namespace lumi::test {

struct Way {
  std::string name;
  RadianceSettings settings;
};
// Plain, and with everything on that can divide by something: at every pixel, from sparse samples, from cells, and the
// optimum.
inline std::vector<Way> Ways() {
  RadianceSettings plain, all;
  all.resolution = Resolution::kJacobian;
  all.resolution_low = 0.4;
  all.time = true;
  all.exposure = true;
  all.correlation = Correlation::kFallingLeaves;
  std::vector<Way> ways;
  for (const auto& [suffix, settings] : {std::pair{"", plain}, {", everything", all}}) {
    const auto add = [&](const char* name, auto change) {
      ways.push_back({std::string(name) + suffix, settings});
      change(ways.back().settings);
    };
    const auto sparse = [](RadianceSettings& s) {
      s.grid_columns = 9;
      s.grid_rows = 7;
      s.sampling = Sampling::kInterpolated;
    };
    add("pixels", [](RadianceSettings&) {});
    add("sparse", sparse);
    add("cells", [&](RadianceSettings& s) {
      sparse(s);
      s.sampling = Sampling::kCandidates;
    });
    add("optimum", [&](RadianceSettings& s) {
      sparse(s);
      s.similarity = Similarity::kFull;
      s.correlation = Correlation::kFallingLeaves;
    });
  }
  return ways;
}

// Alpha and weights that GL blends with differ from the core's by a float's rounding, near ties amplified; the CPU's
// sparse blend weighs in steps of 1/4096.
constexpr float kWeightTolerance = 1e-3F;
// Code values: what is above, for colours half the range apart, and eight bits of a texture's bilinear weights.
constexpr float kColorTolerance = 3.0F / 255;

class GlHardCase : public GlTest {
 protected:
  using GlTest::Draw;
  ImageF Draw(const RadianceSettings& settings, const RenderView& view) {
    const ImageF image = Draw(Request(settings, view));
    ExpectFinite(image);
    return image;
  }
  static RenderRequest Request(const RadianceSettings& settings, const RenderView& view) {
    RenderRequest request;
    request.settings = settings;
    request.view = view;
    return request;
  }

  // Photos of a colour each, for both backends.
  void LoadPainted(World world) {
    Paint(world, PaintOf);
    Load(std::move(world));
    cpu_ = MakeCpuRenderer(WorldOf(world_.scene, world_.proxy), world_.photos);
  }
  // From the middle half of the range: what negative weights take away is not clipped.
  static std::array<std::uint8_t, 3> PaintOf(std::size_t i) {
    const Eigen::Vector3f c = SourceColor(static_cast<int>(i));
    const auto code = [](float x) { return static_cast<std::uint8_t>(std::lround(64 + 127 * x)); };
    return {code(c.x()), code(c.y()), code(c.z())};
  }

  // Weight of each camera at a pixel of WeightPictures(); alpha is not in it.
  std::vector<float> WeightsAt(const std::vector<ImageF>& pictures, int x, int y) const {
    std::vector<float> w(world_.scene.views.size(), 0.0F);
    const float alpha = pictures[0].At(x, y, 3);
    for (std::size_t j = 0; j < w.size() && alpha > 0; ++j)
      w[j] = pictures[j / 3].At(x, y, static_cast<int>(j % 3)) / alpha;
    return w;
  }

  // Weights sum to 1, and lie in [0, 1] unless they are the optimum's, or alpha is 0.
  void ExpectConvex(const RadianceSettings& settings, const std::vector<ImageF>& pictures) {
    // What a premultiplied colour's rounding becomes where alpha is small.
    constexpr float kLeastAlpha = 1e-3F;
    const bool full = settings.similarity == Similarity::kFull;
    for (int y = 0; y < pictures[0].height; ++y)
      for (int x = 0; x < pictures[0].width; ++x) {
        const float alpha = pictures[0].At(x, y, 3);
        ASSERT_TRUE(alpha >= 0 && alpha <= 1) << alpha << " at " << x << " " << y;
        float total = 0;
        for (const ImageF& p : pictures)
          for (int c = 0; c < 3; ++c) {
            const float w = p.At(x, y, c);
            ASSERT_TRUE(std::isfinite(w) && std::abs(w) <= 2) << w << " at " << x << " " << y;
            if (!full) {
              ASSERT_TRUE(w >= 0 && w <= alpha * 1.00001F) << w << " of alpha " << alpha << " at " << x << " " << y;
            }
            total += w;
          }
        if (alpha == 0) {
          ASSERT_EQ(total, 0) << x << " " << y;
        } else if (alpha > kLeastAlpha) {
          ASSERT_NEAR(total / alpha, 1, 1e-4F) << x << " " << y;
        }
      }
  }

  // Share of the pixels at which the two backends' pictures differ.
  double Disagreement(const RadianceSettings& settings, const RenderView& view) {
    const ImageF gl = Draw(settings, view), cpu = cpu_->Render(Request(settings, view));
    int differ = 0;
    for (int y = 0; y < gl.height; ++y)
      for (int x = 0; x < gl.width; ++x) {
        bool same = true;
        for (int c = 0; c < 4; ++c) same = same && std::abs(gl.At(x, y, c) - cpu.At(x, y, c)) <= kColorTolerance;
        differ += !same;
      }
    return static_cast<double>(differ) / (gl.width * gl.height);
  }

  // Both backends in every way; `stray`: the share of pixels that may differ, at silhouettes and where there is a tie.
  void ExpectSound(const RenderView& view, const std::string& what, double stray) {
    for (const Way& way : Ways()) ExpectSound(way, view, what, stray);
  }
  void ExpectSound(const Way& way, const RenderView& view, const std::string& what, double stray) {
    SCOPED_TRACE(what + ", " + way.name);
    ExpectConvex(way.settings, WeightPictures(Request(way.settings, view)));
    const double differ = Disagreement(way.settings, view);
    EXPECT_LE(differ, stray);
    if (stray < 1) worst_ = std::max(worst_, differ);
  }

  void TearDown() override {
    cpu_.reset();
    GlTest::TearDown();
    if (worst_ > 0) std::printf("  at most %.2f %% of a picture's pixels differ between the backends\n", 100 * worst_);
  }

  std::unique_ptr<Renderer> cpu_;
  double worst_ = 0;
};

inline World PhotographedInTurn(int views, int side_px) {
  World w = MakeWorld(views, side_px);
  for (std::size_t i = 0; i < w.scene.views.size(); ++i) w.scene.views[i].time_s = 0.01 * static_cast<double>(i);
  Photograph(w);
  return w;
}

// Cameras at these places that look at the origin and see all that is near it, over the floor. Six of them serve best:
// a shader is compiled for each number of cameras. Lengths are halved twice on the way to the normalised frame: what is
// symmetric here is so in floats.
inline World Over(const std::vector<Eigen::Vector3d>& centres) {
  World w;
  w.scene.cameras = {Camera::Pinhole(32, 32, 10, 10, 16, 16)};
  for (std::size_t i = 0; i < centres.size(); ++i) {
    View v;
    v.name = std::to_string(100000 + i) + ".png";
    v.camera = CameraId{0};
    v.cam_from_world = LookAt(centres[i], {0, 0, 0}, Eigen::Vector3d::UnitY());
    v.time_s = 0;
    w.scene.views.push_back(v);
  }
  UpdateFrameOfReference(w.scene);
  w.scene.normalized_from_world = {0.25, Eigen::Quaterniond::Identity(), {0, 0, 0}};
  AddQuad(w.proxy, {-4, -4, 0}, {4, -4, 0}, {4, 4, 0}, {-4, 4, 0});
  return w;
}

// The middle of the middle pixel, (16, 12), looks straight at `at`.
inline RenderView ViewFrom(const Eigen::Vector3d& eye, const Eigen::Vector3d& at = {0, 0, 0}) {
  return MakeRenderView(Camera::Pinhole(33, 25, 32, 32, 16.5, 12.5), LookAt(eye, at, Eigen::Vector3d::UnitY()));
}

inline std::string Step(double d) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0e", d);
  return text;
}

}  // namespace lumi::test
