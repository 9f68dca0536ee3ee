// Thesis, section 5.3.2: a hand-held video of a paved square before buildings, the camera bobbing with the walk.
#include "simulate/examples.h"
#include "simulate/examples/scene_builder.h"

namespace lumi {
namespace {

using Json = SceneBuilder::Json;
constexpr double kFrontY = 13.0;  // where the houses begin

void PlazaMaterials(SceneBuilder& plaza) {
  plaza.Material("paving", {{"kind", "bricks"},
                            {"colors", {"#9a948a", "#8a857d", "#aaa296", "#7d7a76", "#a3937f"}},
                            {"size", {0.62, 0.41}},
                            {"joint", 0.06},
                            {"joint_color", "#4a4742"},
                            {"variation", 0.22},
                            {"grain", 0.45},
                            {"grain_size", 0.05}});
  plaza.Material("inlay", {{"kind", "tiles"},
                           {"colors", {"#6b4a3c", "#c9bda4", "#54606b", "#b59a6c"}},
                           {"size", 0.3},
                           {"joint", 0.07},
                           {"joint_color", "#39352f"},
                           {"variation", 0.2},
                           {"grain", 0.35},
                           {"grain_size", 0.03},
                           {"seed", 4}});
  plaza.Material("glass", {{"kind", "noise"}, {"colors", {"#1b242c", "#2a3742"}}, {"size", 0.8}}, {{"mirror", 0.18}});
  plaza.Material("frame", {{"kind", "noise"}, {"colors", {"#d9d4c6", "#ece8dc"}}, {"size", 0.1}});
  plaza.Material("stone", {{"kind", "noise"},
                           {"colors", {"#75706a", "#a8a196", "#c0b8aa"}},
                           {"size", 0.35},
                           {"octaves", 7},
                           {"gain", 0.65}});
  plaza.Material("iron", {{"kind", "noise"}, {"colors", {"#1f2826", "#333f3b"}}, {"size", 0.05}},
                 {{"specular", 0.3}, {"shininess", 40}});
  plaza.Material("leaves", {{"kind", "noise"},
                            {"colors", {"#16301a", "#2b5a26", "#6f9438", "#24481f", "#8aa84a"}},
                            {"size", 0.30},
                            {"octaves", 6},
                            {"gain", 0.75},
                            {"bands", 7},
                            {"contrast", 1.2}});
  plaza.Material(
      "bark", {{"kind", "noise"}, {"colors", {"#3c2c20", "#6d5440"}}, {"size", 0.08}, {"octaves", 5}, {"gain", 0.7}});
  plaza.Material("bench", {{"kind", "wood"},
                           {"colors", {"#5e3d22", "#946a41"}},
                           {"size", {1.0, 0.09}},
                           {"joint", 0.1},
                           {"joint_color", "#1c130c"}});
  plaza.Material("poster", {{"kind", "glyphs"},
                            {"colors", {"#f0e6c8", "#b02a2a", "#20486e", "#1a1a1a"}},
                            {"size", {0.13, 0.2}},
                            {"seed", 5}});
  plaza.Material("poster 2", {{"kind", "noise"},
                              {"colors", {"#d8402c", "#f2c14e", "#f4ecd8", "#2d6e8e", "#1b2a41"}},
                              {"size", 0.6},
                              {"octaves", 6},
                              {"bands", 9}});
  plaza.Material("door", {{"kind", "wood"},
                          {"colors", {"#2e1d14", "#553622"}},
                          {"size", {3.0, 0.16}},
                          {"joint", 0.06},
                          {"joint_color", "#120b07"}});
  plaza.Material("bronze",
                 {{"kind", "noise"}, {"colors", {"#2f4a40", "#5b8a74", "#3c3a24"}}, {"size", 0.2}, {"octaves", 6}},
                 {{"specular", 0.3}, {"shininess", 30}});
  const struct {
    const char* wall;
    const char* other;
    const char* joint;
    double w, h;
  } kHouses[] = {{"#a8553f", "#914634", "#c9bba8", 0.42, 0.14}, {"#d8b98a", "#cfae7c", "#a88c62", 0.9, 0.45},
                 {"#8b8f94", "#7d8288", "#55595e", 0.7, 0.35},  {"#c98f6b", "#bb8160", "#e0d2bf", 0.36, 0.12},
                 {"#e0d8c4", "#d4cbb6", "#b5aa92", 1.1, 0.5},   {"#7f3e33", "#6e3329", "#b3a494", 0.40, 0.13}};
  const char* kSigns[] = {"#1f4d3a", "#7a1f24", "#22324f", "#c79a2e", "#3c2a4d", "#20555a"};
  for (int i = 0; i < 6; ++i) {
    const auto& h = kHouses[i];
    const std::string n = std::to_string(i);
    plaza.Material("wall " + n, {{"kind", "bricks"},
                                 {"colors", {h.wall, h.other}},
                                 {"size", {h.w, h.h}},
                                 {"joint", 0.1},
                                 {"joint_color", h.joint},
                                 {"variation", 0.18},
                                 {"grain", 0.3},
                                 {"grain_size", 0.12},
                                 {"seed", i}});
    plaza.Material("sign " + n,
                   {{"kind", "glyphs"}, {"colors", {kSigns[i], "#f2e9cf"}}, {"size", {0.34, 0.52}}, {"seed", 60 + i}});
    plaza.Material("awning " + n, {{"kind", "stripes"}, {"colors", {kSigns[(i + 1) % 6], "#ece4d2"}}, {"size", 0.28}});
  }
}

void House(SceneBuilder& plaza, int i, double x, double width, double y, double height) {
  const std::string n = std::to_string(i);
  plaza.Box("wall " + n, {width, 4.0, height}, x, y + 2.0, 0)["foreground"] = false;
  plaza.Box("stone", {width + 0.2, 0.35, 0.3}, x, y - 0.05, height)["foreground"] = false;
  plaza.Box("stone", {width, 0.12, 0.5}, x, y - 0.05, 0)["foreground"] = false;
  const int columns = static_cast<int>(width / 1.9);
  const double pitch = width / columns;
  for (int floor = 1; 3.1 * floor + 2.3 < height; ++floor)
    for (int c = 0; c < columns; ++c) {
      const double wx = x + (c - 0.5 * (columns - 1)) * pitch, wz = 3.1 * floor + 0.6;
      plaza.Box("frame", {1.06, 0.10, 1.66}, wx, y - 0.01, wz)["foreground"] = false;
      for (int pane = 0; pane < 4; ++pane)
        plaza.Box("glass", {0.43, 0.10, 0.72}, wx + (pane % 2 == 0 ? -0.24 : 0.24), y - 0.03,
                  wz + (pane / 2 == 0 ? 0.08 : 0.86))["foreground"] = false;
      plaza.Box("stone", {1.25, 0.25, 0.08}, wx, y - 0.08, wz - 0.08)["foreground"] = false;
    }
  // Ground floor: a shop with its sign and awning, and a door.
  plaza.Box("glass", {0.52 * width, 0.1, 1.7}, x - 0.16 * width, y - 0.02, 0.55)["foreground"] = false;
  plaza.Box("sign " + n, {0.62 * width, 0.12, 0.56}, x - 0.12 * width, y - 0.04, 2.62)["foreground"] = false;
  Json& awning = plaza.Quad("awning " + n, {0.6 * width, 1.1}, {x - 0.13 * width, y - 0.52, 2.38}, {22, 0, 0});
  awning["name"] = "awning";
  plaza.Box("door", {0.95, 0.1, 2.2}, x + 0.34 * width, y - 0.03, 0)["foreground"] = false;
}

void Tree(SceneBuilder& plaza, double x, double y, double s) {
  plaza.Box("stone", {1.1, 1.1, 0.45}, x, y, 0, 8 * s);
  plaza.Cylinder("bark", 0.11 * s, 2.2 * s, x, y, 0.4)["top_radius"] = 0.07 * s;
  const double kBalls[5][4] = {
      {0, 0, 2.9, 0.85}, {0.55, 0.1, 2.5, 0.6}, {-0.5, 0.2, 2.55, 0.62}, {0.1, -0.5, 2.6, 0.6}, {-0.1, 0.1, 3.4, 0.55}};
  for (const auto& b : kBalls)
    plaza.Sphere("leaves", b[3] * s, x + b[0] * s, y + b[1] * s, 0.4 + b[2] * s)["segments"] = 48;
}

void LampPost(SceneBuilder& plaza, double x, double y) {
  plaza.Cylinder("iron", 0.14, 0.5, x, y, 0)["top_radius"] = 0.09;
  plaza.Cylinder("iron", 0.05, 3.3, x, y, 0.5);
  plaza.Sphere("frame", 0.2, x, y, 3.95);
  plaza.Cylinder("iron", 0.16, 0.12, x, y, 4.1)["top_radius"] = 0.02;
}

}  // namespace

std::string PlazaJson() {
  SceneBuilder plaza("plaza");
  plaza["cameras"] = {{{"name", "camcorder"}, {"size", {640, 480}}, {"fov_deg", 58}}};
  plaza["path"] = {{"kind", "walk"},
                   {"views", 480},
                   {"fps", 30},
                   {"from", {-8.5, 0, 1.62}},
                   {"to", {8.5, 0.8, 1.62}},
                   {"direction", {0.12, 1, 0.06}},
                   {"gait", {{"step_hz", 1.9}, {"bob", 0.045}, {"sway", 0.035}, {"shake_deg", 1.1}}}};
  PlazaMaterials(plaza);
  plaza.Quad("paving", {80, 44}, {0, 8, 0}, {0, 0, 0});
  plaza.Box("inlay", {5.4, 5.4, 0.02}, -0.6, 7.2, 0, 45)["foreground"] = false;
  const double kWidths[] = {7.6, 6.1, 8.7, 5.7, 7.2, 6.6, 8.1};
  const double kHeights[] = {10.2, 12.6, 9.1, 13.4, 10.8, 12.2, 9.6};
  const double kBack[] = {0.0, 0.4, -0.3, 0.5, 0.1, -0.2, 0.3};
  double x = -25;
  for (int i = 0; i < 7; ++i) {
    House(plaza, i % 6, x + 0.5 * kWidths[i], kWidths[i] - 0.02, kFrontY + kBack[i], kHeights[i]);
    x += kWidths[i];
  }
  Tree(plaza, -7.6, 8.9, 1.0);
  Tree(plaza, 3.9, 9.6, 1.12);
  Tree(plaza, 10.8, 8.3, 0.95);
  LampPost(plaza, -4.0, 10.6);
  LampPost(plaza, 7.3, 10.9);
  // A column for posters, a statue, benches.
  plaza.Cylinder("poster", 0.62, 2.5, -10.6, 7.3, 0.25);
  plaza.Cylinder("stone", 0.7, 0.25, -10.6, 7.3, 0);
  plaza.Cylinder("bronze", 0.74, 0.4, -10.6, 7.3, 2.75)["top_radius"] = 0.1;
  plaza.Box("stone", {1.2, 1.2, 1.1}, -0.6, 7.2, 0.02, 45);
  plaza.Loft("bronze",
             {{-0.6, 7.2, 1.12, 0.30, 0.30},
              {-0.6, 7.2, 1.5, 0.20, 0.20},
              {-0.6, 7.2, 2.1, 0.17, 0.16},
              {-0.6, 7.2, 2.6, 0.30, 0.20},
              {-0.6, 7.2, 2.86, 0.12, 0.11},
              {-0.6, 7.2, 3.0, 0.13, 0.14},
              {-0.6, 7.2, 3.18, 0.09, 0.09}},
             {0, 1, 0});
  plaza.Box("poster 2", {1.4, 0.12, 1.9}, 6.0, 6.4, 0.3, -14);
  plaza.Box("iron", {1.5, 0.10, 0.3}, 6.0, 6.4, 0, -14);
  for (const double bx : {-3.2, 2.2, 9.0}) {
    plaza.Box("bench", {1.7, 0.45, 0.06}, bx, 6.0, 0.42, 4 * bx);
    plaza.Box("stone", {1.5, 0.3, 0.42}, bx, 6.0, 0, 4 * bx);
  }
  plaza["lights"] = {{{"towards", {-0.55, -0.75, 0.8}}, {"size_deg", 0.6}, {"color", "#fff2dc"}, {"strength", 0.9}}};
  plaza["ambient"] = {{"sky", "#94a4bb"}, {"ground", "#6a6358"}};
  plaza["background"] = {{"texture",
                          {{"kind", "noise"},
                           {"colors", {"#5f93cf", "#7aa8da", "#b4cde6", "#eef2f5"}},
                           {"size", 0.5},
                           {"octaves", 6},
                           {"gain", 0.5},
                           {"contrast", 0.8},
                           {"seed", 9}}}};
  return plaza.Text();
}

}  // namespace lumi
