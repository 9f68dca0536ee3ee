// Thesis, section 4.4: "various items in front of a black background", 262 images.
#include <cmath>

#include "scene/geometry/angle.h"
#include "simulate/examples.h"
#include "simulate/examples/scene_builder.h"

namespace lumi {
namespace {

using Json = SceneBuilder::Json;

void DeskMaterials(SceneBuilder& desk) {
  desk.Material("oak",
                {{"kind", "wood"},
                 {"colors", {"#6b4526", "#a87748", "#c99a63", "#8d5f38"}},
                 {"size", {0.9, 0.13}},
                 {"joint", 0.012},
                 {"joint_color", "#2d1c10"},
                 {"variation", 0.2},
                 {"grain", 0.35},
                 {"grain_size", 0.006}},
                {{"specular", 0.05}, {"shininess", 40}});
  desk.Material("mat", {{"kind", "cells"},
                        {"colors", {"#1f3f57", "#2f6f7f", "#c8a24a", "#7f2f35", "#d9d2bc"}},
                        {"size", 0.022},
                        {"joint", 0.1},
                        {"joint_color", "#10181f"},
                        {"grain", 0.3},
                        {"grain_size", 0.004}});
  desk.Material("news", {{"kind", "glyphs"},
                         {"colors", {"#e9e4d4", "#26262a", "#33333a", "#26262a"}},
                         {"size", {0.0085, 0.0125}},
                         {"seed", 3}});
  desk.Material("headline",
                {{"kind", "glyphs"}, {"colors", {"#e4dfcf", "#1c1c20"}}, {"size", {0.026, 0.042}}, {"seed", 8}});
  const struct {
    const char* name;
    const char* cover;
    const char* ink;
    const char* second;
    double letter;
    int seed;
  } kBooks[] = {{"book red", "#8c2a24", "#f0d8a0", "#e8e0d0", 0.017, 11},
                {"book blue", "#23467a", "#e8e4da", "#f2b84b", 0.014, 12},
                {"book green", "#2f6b45", "#f4efd8", "#111511", 0.019, 13},
                {"book yellow", "#d2a032", "#3a1d12", "#7a1d1d", 0.015, 14},
                {"book white", "#d9d5cb", "#2c4a86", "#a02c2c", 0.016, 15},
                {"book violet", "#57386e", "#e9d9b0", "#ddd6ee", 0.018, 16}};
  for (const auto& book : kBooks)
    desk.Material(book.name,
                  {{"kind", "glyphs"},
                   {"colors", {book.cover, book.ink, book.second}},
                   {"size", {book.letter, 1.5 * book.letter}},
                   {"seed", book.seed},
                   {"grain", 0.2},
                   {"grain_size", 0.004}},
                  {{"specular", 0.06}, {"shininess", 25}});
  desk.Material("globe",
                {{"kind", "noise"},
                 {"colors", {"#123c66", "#1c5c92", "#2f7fb8", "#d8c690", "#5f8f45", "#3f6b33", "#86643c", "#e9e4da"}},
                 {"size", 0.085},
                 {"octaves", 7},
                 {"gain", 0.58},
                 {"bands", 8},
                 {"contrast", 0.9},
                 {"seed", 5}},
                {{"specular", 0.35}, {"shininess", 90}, {"mirror", 0.03}});
  desk.Material("brass", {{"kind", "noise"}, {"colors", {"#7d5a20", "#c79a45"}}, {"size", 0.01}},
                {{"specular", 0.5}, {"shininess", 50}, {"mirror", 0.25}});
  desk.Material("vase",
                {{"kind", "cells"},
                 {"colors", {"#e6ecef", "#3567a5", "#dfe7ee", "#1f4785", "#eef1f2"}},
                 {"size", 0.024},
                 {"joint", 0.09},
                 {"joint_color", "#132d5c"},
                 {"grain", 0.15},
                 {"grain_size", 0.005}},
                {{"specular", 0.5}, {"shininess", 140}, {"mirror", 0.04}});
  desk.Material("cup",
                {{"kind", "stripes"},
                 {"colors", {"#c9472b", "#efe6d2", "#2a6f77", "#efe6d2"}},
                 {"size", 0.0122},
                 {"grain", 0.25},
                 {"grain_size", 0.004}},
                {{"specular", 0.25}, {"shininess", 60}});
  desk.Material(
      "label",
      {{"kind", "glyphs"}, {"colors", {"#d8542f", "#fff4d6", "#241a12"}}, {"size", {0.016, 0.022}}, {"seed", 21}},
      {{"specular", 0.15}, {"shininess", 40}});
  desk.Material("tin", {{"kind", "noise"}, {"colors", {"#8e9296", "#c4c8cc"}}, {"size", 0.012}},
                {{"specular", 0.6}, {"shininess", 80}, {"mirror", 0.3}});
  desk.Material("chrome", {{"kind", "noise"}, {"colors", {"#3c3f44", "#55585e"}}, {"size", 0.03}},
                {{"specular", 0.8}, {"shininess", 400}, {"mirror", 0.55}});
  desk.Material("marble",
                {{"kind", "noise"},
                 {"colors", {"#2d3b33", "#e8e6df", "#cfd3cb", "#5c7265", "#eeeae2"}},
                 {"size", 0.05},
                 {"octaves", 7},
                 {"gain", 0.62},
                 {"contrast", 1.2},
                 {"seed", 31}},
                {{"specular", 0.3}, {"shininess", 120}});
  desk.Material("card", {{"kind", "noise"},
                         {"colors", {"#2a4d7c", "#8cb8d8", "#f0e8d0", "#d88a3c", "#7a3420"}},
                         {"size", 0.045},
                         {"octaves", 7},
                         {"bands", 10},
                         {"seed", 41}});
  const char* kBlocks[] = {"#c8a06a", "#b98c58", "#d4b07c"};
  const char* kInks[] = {"#a02020", "#1f5080", "#2a6a30"};
  for (int i = 0; i < 3; ++i)
    desk.Material("block " + std::to_string(i), {{"kind", "glyphs"},
                                                 {"colors", {kBlocks[i], kInks[i], kInks[(i + 1) % 3]}},
                                                 {"size", {0.021, 0.030}},
                                                 {"seed", 50 + i},
                                                 {"grain", 0.25},
                                                 {"grain_size", 0.005}});
  const char* kPencils[] = {"#e0b020", "#b03028", "#2860a0", "#308048"};
  for (int i = 0; i < 4; ++i) desk.Material("pencil " + std::to_string(i), {{"color", kPencils[i]}});
}

void Objects(SceneBuilder& desk) {
  desk.Box("oak", {1.36, 0.90, 0.04}, 0, 0, -0.04);
  desk.Box("mat", {0.46, 0.32, 0.003}, 0.06, -0.13, 0, -4);

  // A row of books at the back, held by a marble block.
  const char* kRow[] = {"book red", "book blue", "book green", "book yellow", "book white", "book violet", "book blue"};
  const double kWidth[] = {0.034, 0.027, 0.041, 0.024, 0.037, 0.030, 0.034};
  const double kTall[] = {0.225, 0.205, 0.240, 0.190, 0.215, 0.232, 0.198};
  double x = -0.20;
  for (int i = 0; i < 7; ++i) {
    desk.Box(kRow[i], {kWidth[i], 0.155 - 0.004 * (i % 3), kTall[i]}, x + 0.5 * kWidth[i], 0.285 - 0.005 * (i % 2), 0);
    x += kWidth[i] + 0.0015;
  }
  desk.Box("marble", {0.06, 0.12, 0.13}, x + 0.034, 0.285, 0);
  // A stack lying on the left, a can upon it.
  desk.Box("book yellow", {0.250, 0.180, 0.036}, -0.405, 0.105, 0, 14);
  desk.Box("book violet", {0.225, 0.165, 0.028}, -0.400, 0.100, 0.036, 2);
  desk.Box("book white", {0.205, 0.150, 0.033}, -0.410, 0.108, 0.064, 24);
  desk.Cylinder("label", 0.034, 0.086, -0.420, 0.105, 0.097);
  desk.Cylinder("tin", 0.035, 0.003, -0.420, 0.105, 0.183);

  // Globe on a foot.
  desk.Cylinder("brass", 0.062, 0.012, 0.335, 0.155, 0)["top_radius"] = 0.054;
  desk.Cylinder("brass", 0.010, 0.04, 0.335, 0.155, 0.012);
  desk.Sphere("globe", 0.108, 0.335, 0.155, 0.155)["rotate_deg"] = {0, 23, 0};

  // Vase.
  desk.Loft("vase",
            {{-0.175, 0.075, 0, 0.030, 0.030},
             {-0.175, 0.075, 0.02, 0.044, 0.044},
             {-0.175, 0.075, 0.075, 0.058, 0.058},
             {-0.175, 0.075, 0.13, 0.034, 0.034},
             {-0.175, 0.075, 0.165, 0.022, 0.022},
             {-0.175, 0.075, 0.19, 0.033, 0.033}},
            {0, 1, 0});
  // Cup with pencils.
  desk.Cylinder("cup", 0.039, 0.098, 0.50, -0.07, 0)["top_radius"] = 0.042;
  const double kLean[4][2] = {{9, 4}, {-7, 8}, {3, -10}, {-8, -5}};
  for (int i = 0; i < 4; ++i) {
    Json& pencil = desk.Cylinder("pencil " + std::to_string(i), 0.0042, 0.175, 0.50 + 0.0015 * kLean[i][1],
                                 -0.07 - 0.0015 * kLean[i][0], 0.01);
    pencil["rotate_deg"] = {kLean[i][0], kLean[i][1], 0};
    pencil["segments"] = 24;
  }
  // Blocks with letters.
  desk.Box("block 0", {0.060, 0.060, 0.060}, 0.02, -0.10, 0.003, 18);
  desk.Box("block 1", {0.060, 0.060, 0.060}, 0.10, -0.07, 0.003, -12);
  desk.Box("block 2", {0.060, 0.060, 0.060}, 0.057, -0.086, 0.063, 31);
  // Balls that show what is around them.
  desk.Sphere("chrome", 0.042, 0.20, -0.19, 0.045);
  desk.Sphere("marble", 0.034, -0.08, -0.19, 0.037);
  desk.Sphere("globe", 0.026, 0.145, -0.275, 0.026);
  // Paper.
  desk.Box("news", {0.27, 0.20, 0.004}, -0.36, -0.21, 0, 17);
  desk.Box("headline", {0.262, 0.048, 0.0012}, -0.381, -0.143, 0.004, 17);
  desk.Box("card", {0.145, 0.100, 0.0015}, 0.40, -0.27, 0, -21);
  desk.Box("card", {0.145, 0.100, 0.0015}, 0.47, -0.22, 0.0015, 9);
  desk.Box("card", {0.13, 0.19, 0.004}, 0.575, 0.17, 0, 4)["rotate_deg"] = {0, 0, 4};
}

}  // namespace

std::string DeskJson() {
  SceneBuilder desk("desk");
  desk["cameras"] = {{{"name", "compact"}, {"size", {640, 480}}, {"fov_deg", 52}}};
  // Thirteen places in three rows on a cap before the desk; neighbours see it from about 15 degrees apart. One goes
  // through the rows as one reads, each from the other side, so that any few evenly chosen photos overlap.
  const Eigen::Vector3d target(0.02, 0.0, 0.07);
  const double kRows[3][3] = {{18, 5, 1.20}, {33, 4, 1.22}, {49, 4, 1.24}};  // elevation, places, distance
  Json centres = Json::array();
  for (int row = 0; row < 3; ++row) {
    const int places = static_cast<int>(kRows[row][1]);
    for (int i = 0; i < places; ++i) {
      const double across = (2.0 * i / (places - 1) - 1) * (row % 2 == 0 ? 1 : -1);
      const double azimuth = across * (row == 0 ? 34 : 27) * kRadPerDeg, elevation = kRows[row][0] * kRadPerDeg;
      const Eigen::Vector3d eye =
          target + kRows[row][2] * Eigen::Vector3d(std::sin(azimuth) * std::cos(elevation),
                                                   -std::cos(azimuth) * std::cos(elevation), std::sin(elevation));
      const auto rounded = [](double value) { return std::round(1000 * value) / 1000; };
      centres.push_back({rounded(eye.x()), rounded(eye.y()), rounded(eye.z())});
    }
  }
  desk["path"] = {{"kind", "clusters"},
                  {"views", 262},
                  {"centres", centres},
                  {"spread", 0.13},
                  {"look_at", {target.x(), target.y(), target.z()}}};
  DeskMaterials(desk);
  Objects(desk);
  desk["lights"] = {{{"towards", {-0.45, -0.5, 1.0}}, {"size_deg", 3}, {"color", "#fff6e8"}, {"strength", 0.85}},
                    {{"towards", {0.8, -0.3, 0.5}}, {"color", "#c8d8ff"}, {"strength", 0.16}, {"shadows", false}}};
  desk["ambient"] = {{"sky", "#8a8c94"}, {"ground", "#5a5048"}};
  desk["background"] = {{"color", "#040405"}};
  desk["environment"] = {{"zenith", "#b8c0cc"}, {"horizon", "#1c1e22"}, {"ground", "#101010"}};
  return desk.Text();
}

}  // namespace lumi
