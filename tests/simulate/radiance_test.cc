// Light whose answer is known.
#include <gtest/gtest.h>

#include <cmath>

#include "scene/program/parallel.h"
#include "simulate/photo_response.h"
#include "simulate/textures.h"
#include "tests/simulate/small_scene.h"

namespace lumi {
namespace {

constexpr const char* kCamera = R"("cameras": [{"size": [48, 36], "fov_deg": 60}], )";

void ExpectConstant(const Image8& photo, int r, int g, int b) {
  const int expected[3] = {r, g, b};
  for (int y = 0; y < photo.height; ++y)
    for (int x = 0; x < photo.width; ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(photo.At(x, y, c), expected[c]) << x << " " << y << " " << c;
}

TEST(Radiance, AConstantWorldRendersConstant) {
  const SmallScene scene(std::string("{") + kCamera + R"(
    "path": {"kind": "poses", "poses": [{"eye": [0, -4, 1], "target": [0, 0, 0]}]},
    "materials": [{"name": "m", "color": "#5a8cc8", "lit": false}],
    "objects": [{"kind": "quad", "size": [3, 3], "material": "m"},
                {"kind": "sphere", "radius": 0.7, "position": [0, 0, 0.7], "material": "m"},
                {"kind": "box", "size": [0.5, 0.4, 0.9], "position": [1, 0.3, 0.5], "material": "m"}],
    "background": {"color": "#5a8cc8"}})");
  ExpectConstant(scene.Render().photo, 0x5a, 0x8c, 0xc8);
}

TEST(Radiance, AmbientLightAloneShowsTheColourOfASurface) {
  const SmallScene scene(std::string("{") + kCamera + R"(
    "path": {"kind": "poses", "poses": [{"eye": [0, 0, 1], "target": [0, 0.01, 0]}]},
    "materials": [{"name": "m", "color": [0.5, 0.25, 0.75]}],
    "objects": [{"kind": "quad", "size": [30, 30], "material": "m"}],
    "ambient": {"sky": [1, 1, 1]}})");
  ExpectConstant(scene.Render().photo, 128, 64, 191);
}

TEST(Radiance, ALampLightsBySlantAndItsShadowIsDark) {
  // Straight above: full. At 60 degrees: half the light. A box over the plane keeps it off.
  const std::pair<const char*, double> kLamps[] = {{"[0, 0, 1]", 1.0}, {"[0.8660254037844386, 0, 0.5]", 0.5}};
  for (const auto& [towards, share] : kLamps) {
    const SmallScene scene(std::string("{") + kCamera + R"(
      "path": {"kind": "poses", "poses": [{"eye": [0, 0, 1], "target": [0, 0.01, 0]}]},
      "materials": [{"name": "m", "color": [1, 1, 1]}],
      "objects": [{"kind": "quad", "size": [30, 30], "material": "m"}],
      "ambient": {"sky": [0, 0, 0]},
      "lights": [{"towards": )" +
                           towards + "}]}");
    const int expected = static_cast<int>(std::lround(255 * CodeFromLight(share)));
    ExpectConstant(scene.Render().photo, expected, expected, expected);
  }
  const SmallScene shaded(std::string("{") + kCamera + R"(
    "path": {"kind": "poses", "poses": [{"eye": [0, 0, 1], "target": [0, 0.01, 0]}]},
    "materials": [{"name": "m", "color": [1, 1, 1]}],
    "objects": [{"kind": "quad", "size": [30, 30], "material": "m"},
                {"kind": "box", "size": [30, 30, 0.1], "position": [0, 0, 3], "material": "m"}],
    "ambient": {"sky": [0, 0, 0]},
    "lights": [{"towards": [0, 0, 1]}]})");
  ExpectConstant(shaded.Render().photo, 0, 0, 0);
}

TEST(Radiance, AMirrorShowsItsEnvironmentAndChangesWithTheDirection) {
  const auto pixel = [](const std::string& eye) {
    const SmallScene scene(std::string("{") + kCamera + R"(
      "path": {"kind": "poses", "poses": [{"eye": )" +
                           eye + R"(, "target": [0, 0, 0]}]},
      "materials": [{"name": "m", "color": [0, 0, 0], "mirror": 1}],
      "objects": [{"kind": "quad", "size": [0.5, 0.5], "material": "m"}],
      "background": {"color": "#00ff00"},
      "environment": {"zenith": "#ff0000", "horizon": "#0000ff"}})");
    const Image8 photo = scene.Render().photo;
    return std::array<int, 3>{photo.At(24, 18, 0), photo.At(24, 18, 1), photo.At(24, 18, 2)};
  };
  const auto from_above = pixel("[0, -0.01, 2]"), from_the_side = pixel("[0, -2, 0.4]");
  EXPECT_GT(from_above[0], 250);
  EXPECT_LT(from_above[2], 40);
  EXPECT_EQ(from_above[1], 0);
  EXPECT_GT(from_the_side[2], from_above[2] + 100);
}

TEST(Radiance, TheSameBytesOnAnyNumberOfThreads) {
  const std::string json = std::string("{") + kCamera + R"(
    "path": {"kind": "walk", "views": 20, "from": [-1, -4, 1], "to": [1, -4, 1]},
    "materials": [{"name": "noise", "texture": {"kind": "noise", "size": 0.5, "bands": 5, "colors": ["#102030", "#e0c080"]}},
                  {"name": "floor", "texture": {"kind": "cells", "size": 0.3}, "mirror": 0.3, "roughness_deg": 3}],
    "objects": [{"kind": "quad", "size": [9, 9], "material": "floor"},
                {"kind": "box", "size": [1, 1, 1], "position": [0, 0, 0.6], "material": "noise", "spin": {"period_s": 1}}],
    "lights": [{"towards": [1, -1, 1], "size_deg": 2}],
    "effects": {"noise_sigma": 3, "rolling_shutter_s": 0.02, "motion_blur_s": 0.01, "vignetting": 0.3, "exposure_stops": 0.4}})";
  const SmallScene scene(json, 0, 7);
  SetThreadCount(1);
  const RenderedView one = scene.Render(9);
  SetThreadCount(4);
  const RenderedView four = scene.Render(9);
  SetThreadCount(0);
  EXPECT_EQ(one.photo.data, four.photo.data);
  EXPECT_EQ(one.depth.data, four.depth.data);
  EXPECT_EQ(one.silhouette.data, four.silhouette.data);
  const SmallScene other_seed(json, 0, 8);
  EXPECT_NE(one.photo.data, other_seed.Render(9).photo.data);
}

TEST(Checker, AveragesItsSquaresOverTheFootprint) {
  TextureDescription description;
  description.kind = TextureKind::kChecker;
  description.colors = {Rgb(0, 0, 0), Rgb(1, 1, 1)};
  description.size = {0.02, 0.02};
  const Texture checker(description);
  const auto at = [&](double u, double v, double footprint) {
    return checker
        .At({Eigen::Vector3f::Zero(), Eigen::Vector2f(static_cast<float>(u), static_cast<float>(v)),
             static_cast<float>(footprint)})
        .x();
  };
  constexpr float kTolerance = 2e-4f;  // floats, over a footprint of a fortieth of a square
  for (const double fine : {0.0, 0.0005}) {
    EXPECT_NEAR(at(0.01, 0.01, fine), 0, kTolerance);
    EXPECT_NEAR(at(0.03, 0.01, fine), 1, kTolerance);
    EXPECT_NEAR(at(0.03, 0.03, fine), 0, kTolerance);
    EXPECT_NEAR(at(-0.01, 0.01, fine), 1, kTolerance);
  }
  EXPECT_NEAR(at(0.02, 0.02, 0.001), 0.5, kTolerance);      // at a corner
  EXPECT_NEAR(at(0.02025, 0.01, 0.001), 0.75, kTolerance);  // a quarter of the footprint beyond an edge
  EXPECT_NEAR(at(0.013, 0.007, 0.04), 0.5, kTolerance);     // two squares wide: grey
}

}  // namespace
}  // namespace lumi
