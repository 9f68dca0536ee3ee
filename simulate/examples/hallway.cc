// Thesis, section 5.3.3: a robot drives down a corridor; 1096 frames, of a rectangular tube with doors and cabinets.
#include "simulate/examples.h"
#include "simulate/examples/scene_builder.h"

namespace lumi {
namespace {

using Json = SceneBuilder::Json;
constexpr double kHalfWidth = 1.2, kHeight = 2.6, kBegin = -3.0, kLength = 40.0;  // metres

void HallwayMaterials(SceneBuilder& hall) {
  hall.Material("floor",
                {{"kind", "tiles"},
                 {"colors", {"#a8a498", "#9c978a", "#b3ad9f", "#8f8a7e"}},
                 {"size", 0.3},
                 {"joint", 0.02},
                 {"joint_color", "#6f6a60"},
                 {"variation", 0.08},
                 {"grain", 0.35},
                 {"grain_size", 0.012}},
                {{"mirror", 0.07}, {"roughness_deg", 0.35}});
  hall.Material("plaster left", {{"kind", "noise"},
                                 {"colors", {"#b9b49f", "#d8d3bf"}},
                                 {"size", 0.6},
                                 {"octaves", 8},
                                 {"gain", 0.72},
                                 {"grain", 0.12},
                                 {"grain_size", 0.01}});
  hall.Material("plaster right", {{"kind", "noise"},
                                  {"colors", {"#a9b0ae", "#ccd2cf"}},
                                  {"size", 0.5},
                                  {"octaves", 8},
                                  {"gain", 0.72},
                                  {"grain", 0.12},
                                  {"grain_size", 0.01}});
  hall.Material("ceiling", {{"kind", "tiles"},
                            {"colors", {"#c9c8c0", "#c2c1b9"}},
                            {"size", 0.6},
                            {"joint", 0.03},
                            {"joint_color", "#8c8b84"},
                            {"variation", 0.03},
                            {"grain", 0.5},
                            {"grain_size", 0.02}});
  hall.Material("door",
                {{"kind", "wood"},
                 {"colors", {"#6a4427", "#95673c", "#b58450"}},
                 {"size", {3.0, 0.9}},
                 {"joint", 0},
                 {"variation", 0.1}},
                {{"specular", 0.08}, {"shininess", 30}});
  hall.Material("frame", {{"kind", "noise"}, {"colors", {"#4c5a5c", "#5d6c6e"}}, {"size", 0.1}});
  hall.Material("base", {{"kind", "noise"}, {"colors", {"#3a3f40", "#50585a"}}, {"size", 0.05}});
  hall.Material("brass", {{"color", "#b08d45"}}, {{"specular", 0.6}, {"shininess", 60}, {"mirror", 0.2}});
  hall.Material("plate",
                {{"kind", "glyphs"}, {"colors", {"#1f2f44", "#f0f0f0"}}, {"size", {0.035, 0.05}}, {"seed", 2}});
  hall.Material("orange paper",
                {{"kind", "glyphs"}, {"colors", {"#f08020", "#30180a"}}, {"size", {0.05, 0.075}}, {"seed", 7}});
  hall.Material("cabinet",
                {{"kind", "tiles"},
                 {"colors", {"#7c8a8c", "#748284"}},
                 {"size", {0.45, 0.42}},
                 {"joint", 0.05},
                 {"joint_color", "#2e3638"},
                 {"grain", 0.15},
                 {"grain_size", 0.02}},
                {{"specular", 0.15}, {"shininess", 40}});
  hall.Material("red", {{"kind", "glyphs"}, {"colors", {"#b0201c", "#f4ece0"}}, {"size", {0.03, 0.05}}, {"seed", 4}},
                {{"specular", 0.5}, {"shininess", 80}});
  hall.Material("cork",
                {{"kind", "noise"}, {"colors", {"#7d5630", "#a97c4c", "#946a3d"}}, {"size", 0.03}, {"octaves", 4}});
  hall.Material("lamp", {{"color", "#ffffff"}}, {{"lit", false}});
  hall.Material("window",
                {{"kind", "noise"}, {"colors", {"#bcd8f0", "#eef6fb", "#8fb6a0"}}, {"size", 0.5}, {"octaves", 5}},
                {{"lit", false}});
  hall.Material("leaves", {{"kind", "noise"},
                           {"colors", {"#1c3a1c", "#5d8a38", "#2d5a28"}},
                           {"size", 0.12},
                           {"octaves", 5},
                           {"gain", 0.7},
                           {"bands", 6}});
  const char* kPapers[] = {"#f2efe6", "#f4e28a", "#bfe0f0", "#f2b8b0"};
  for (int i = 0; i < 4; ++i)
    hall.Material(
        "note " + std::to_string(i),
        {{"kind", "glyphs"}, {"colors", {kPapers[i], "#202428"}}, {"size", {0.018, 0.027}}, {"seed", 30 + i}});
  const char* kPictures[][4] = {{"#12304a", "#3f7fa8", "#e8d8a8", "#c05a2c"},
                                {"#2a1a30", "#8c3a5c", "#e8a060", "#f4e8c8"},
                                {"#183820", "#5a8c4a", "#d8d890", "#7a4a2a"}};
  for (int i = 0; i < 3; ++i)
    hall.Material("picture " + std::to_string(i),
                  {{"kind", "noise"},
                   {"colors", {kPictures[i][0], kPictures[i][1], kPictures[i][2], kPictures[i][3]}},
                   {"size", 0.3},
                   {"octaves", 7},
                   {"bands", 8},
                   {"contrast", 1.2},
                   {"seed", 70 + i}});
}

// On the wall at side -1 (left) or 1: a box `depth` deep, `width` along the corridor.
Json& OnWall(SceneBuilder& hall, const std::string& material, int side, double y, double z, double width, double height,
             double depth) {
  Json& box = hall.Box(material, {depth, width, height}, side * (kHalfWidth - 0.5 * depth), y, z);
  box["foreground"] = false;
  return box;
}

void Door(SceneBuilder& hall, int side, double y) {
  OnWall(hall, "frame", side, y, 0.0, 1.06, 2.14, 0.07);
  OnWall(hall, "door", side, y, 0.004, 0.90, 2.05, 0.085);
  hall.Sphere("brass", 0.03, side * (kHalfWidth - 0.13), y - 0.36 * side, 1.02);
  OnWall(hall, "plate", side, y + 0.72, 1.52, 0.22, 0.12, 0.015);
}

void Board(SceneBuilder& hall, int side, double y) {
  OnWall(hall, "door", side, y, 1.05, 1.5, 0.98, 0.025);
  OnWall(hall, "cork", side, y, 1.09, 1.42, 0.90, 0.032);
  for (int i = 0; i < 8; ++i)
    OnWall(hall, "note " + std::to_string((i + (side > 0 ? 1 : 0)) % 4), side, y - 0.52 + 0.345 * (i % 4),
           1.14 + 0.42 * (i / 4) + 0.02 * (i % 3), 0.21 + 0.02 * (i % 2), 0.29, 0.035 + 0.001 * i);
}

}  // namespace

std::string HallwayJson() {
  SceneBuilder hall("hallway");
  hall["cameras"] = {{{"name", "robot"}, {"size", {320, 240}}, {"fov_deg", 70}}};
  hall["path"] = {{"kind", "drive"},      {"views", 1096},          {"fps", 30},
                  {"from", {0, 0, 1.25}}, {"to", {0.05, 29, 1.25}}, {"direction", {0.02, 1, -0.02}},
                  {"weave", 0.06}};
  HallwayMaterials(hall);
  hall["objects"].push_back({{"kind", "tube"},
                             {"name", "corridor"},
                             {"material", {"floor", "plaster left", "ceiling", "plaster right"}},
                             {"size", {2 * kHalfWidth, kLength, kHeight}},
                             {"position", {0, kBegin, 0}}});
  hall.Quad("plaster left", {2 * kHalfWidth, kHeight}, {0, kBegin + kLength, 0.5 * kHeight}, {90, 0, 0});
  hall.Quad("plaster right", {2 * kHalfWidth, kHeight}, {0, kBegin, 0.5 * kHeight}, {90, 0, 180});
  hall.Box("frame", {1.5, 0.06, 1.5}, 0, kBegin + kLength - 0.03, 0.75)["foreground"] = false;
  hall.Box("window", {1.36, 0.08, 1.36}, 0, kBegin + kLength - 0.04, 0.82)["foreground"] = false;
  for (const int side : {-1, 1}) OnWall(hall, "base", side, kBegin + 0.5 * kLength, 0, kLength, 0.11, 0.018);
  for (int i = 0; i < 9; ++i) {
    Door(hall, -1, 1.6 + 4.0 * i);
    Door(hall, 1, 3.4 + 4.0 * i);
  }
  int picture = 0;
  for (int i = 0; i < 9; ++i) {
    const double left = 3.6 + 4.0 * i, right = 5.4 + 4.0 * i;
    if (i % 3 == 1)
      Board(hall, -1, left);
    else
      OnWall(hall, "picture " + std::to_string(picture++ % 3), -1, left, 1.15, 0.85, 0.65, 0.03);
    if (i % 3 == 2)
      Board(hall, 1, right);
    else if (i % 3 == 0)
      OnWall(hall, "cabinet", 1, right - 0.1, 0, 1.35, 1.26, 0.36);
    else
      OnWall(hall, "picture " + std::to_string(picture++ % 3), 1, right, 1.2, 0.6, 0.8, 0.03);
  }
  OnWall(hall, "orange paper", -1, 11.1, 1.25, 0.5, 0.66, 0.012);
  OnWall(hall, "orange paper", 1, 19.3, 1.3, 0.36, 0.5, 0.012);
  for (const double y : {6.6, 22.6}) {
    hall.Cylinder("red", 0.075, 0.46, -kHalfWidth + 0.1, y, 0.65);
    hall.Sphere("red", 0.075, -kHalfWidth + 0.1, y, 1.11);
  }
  for (const double y : {13.2, 27.6}) {
    hall.Cylinder("cabinet", 0.16, 0.42, -kHalfWidth + 0.2, y, 0)["top_radius"] = 0.2;
    for (int i = 0; i < 4; ++i)
      hall.Sphere("leaves", 0.17, -kHalfWidth + 0.22 + 0.05 * (i % 2), y + 0.08 * (i - 1.5),
                  0.6 + 0.16 * i)["segments"] = 48;
  }
  for (int i = 0; i < 10; ++i) {
    const double y = kBegin + 2.0 + 4.0 * i;
    hall.Box("frame", {0.66, 1.26, 0.03}, 0, y, kHeight - 0.03)["foreground"] = false;
    hall.Box("lamp", {0.58, 1.18, 0.034}, 0, y, kHeight - 0.034)["foreground"] = false;
    hall["lights"].push_back({{"position", {0, y, kHeight - 0.25}},
                              {"reach", 1.1},
                              {"color", "#fffaf0"},
                              {"strength", 0.95},
                              {"shadows", false}});
  }
  hall["ambient"] = {{"sky", "#a09e96"}, {"ground", "#96948e"}};
  hall["background"] = {{"color", "#000000"}};
  return hall.Text();
}

}  // namespace lumi
