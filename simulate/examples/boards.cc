// What lumi-calibrate is for: a checkerboard of 9x6 inner corners, squares of 25 mm, photographed through a lens with the thesis's seven terms
// (fx, fy, cx, cy, skew, two of radial distortion), each away from its resting value.
#include <cmath>

#include "scene/geometry/angle.h"
#include "simulate/examples.h"
#include "simulate/examples/scene_builder.h"

namespace lumi {
namespace {

using Json = SceneBuilder::Json;

constexpr int kColumns = 10, kRows = 7;  // squares
constexpr double kSquare = 0.025, kMargin = 0.02;

// Around the board's middle; the target is what the picture's middle shows.
struct Pose {
  double tilt_deg;              // off the vertical
  double azimuth_deg;           // which also turns the board in the picture
  double distance;
  double target_x, target_y;    // on the board
};

constexpr Pose kPoses[] = {{4, 0, 0.36, 0, 0},          {30, 15, 0.42, -0.07, -0.04},  {32, 80, 0.44, 0.04, 0.05},    {28, 160, 0.42, 0.06, -0.04},
                           {35, 215, 0.44, -0.05, 0.04}, {25, 270, 0.46, 0.05, -0.06},  {38, 310, 0.42, 0.02, 0.03},   {20, 350, 0.40, 0.05, 0.035},
                           {33, 45, 0.46, -0.03, 0.03},  {27, 120, 0.46, -0.02, -0.03}, {36, 190, 0.42, 0.06, 0.02},   {24, 240, 0.46, 0.03, 0.06},
                           {40, 0, 0.44, 0.02, -0.05},   {30, 100, 0.46, 0, -0.06},     {15, 180, 0.40, -0.055, 0.03}, {34, 285, 0.46, -0.03, 0.05}};

}  // namespace

std::string BoardsJson() {
  SceneBuilder boards("boards");
  boards["image"] = {{"format", "png"}, {"samples_per_pixel", 4}};
  boards["cameras"] = {{{"name", "lens"}, {"size", {640, 480}}, {"model", "OPENCV"}, {"params", {612.3, 620.26, 331.7, 232.1, -0.21, 0.06, 0, 0}}}};
  Json poses = Json::array();
  for (const Pose& p : kPoses) {
    const double tilt = p.tilt_deg * kRadPerDeg, azimuth = p.azimuth_deg * kRadPerDeg;
    const double away = p.distance * std::sin(tilt);
    poses.push_back({{"eye", {p.target_x + away * std::sin(azimuth), p.target_y - away * std::cos(azimuth), p.distance * std::cos(tilt)}},
                     {"target", {p.target_x, p.target_y, 0}}});
  }
  boards["path"] = {{"kind", "poses"}, {"poses", poses}};
  boards.Material("table", {{"color", "#7d5a3c"}});
  boards.Material("paper", {{"color", "#e4e4e0"}});
  boards.Material("board", {{"kind", "checker"}, {"colors", {"#242424", "#e4e4e0"}}, {"size", kSquare}});
  boards.Quad("table", {1.6, 1.2}, {0, 0, -0.004}, {0, 0, 0});
  boards.Quad("paper", {kColumns * kSquare + 2 * kMargin, kRows * kSquare + 2 * kMargin}, {0, 0, -1e-4}, {0, 0, 0});
  boards.Quad("board", {kColumns * kSquare, kRows * kSquare}, {0, 0, 0}, {0, 0, 0});
  boards["lights"] = {{{"towards", {-0.4, -0.3, 1}}, {"color", "#fff6ea"}, {"strength", 0.35}, {"shadows", false}}};
  boards["ambient"] = {{"sky", "#b0b0b0"}, {"ground", "#606060"}};
  boards["background"] = {{"color", "#303438"}};
  boards["effects"] = {{"skew_px", 2.4}, {"noise_sigma", 2.5}};
  return boards.Text();
}

}  // namespace lumi
