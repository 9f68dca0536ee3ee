#include "simulate/examples/periodic_room.h"

namespace lumi {

void AddPaperAndIron(SceneBuilder& scene) {
  scene.Material("paper", {{"kind", "noise"},
                           {"colors", {"#f6d27a", "#c8472f", "#fbf0cf", "#2e6f8f", "#f0a040", "#44306a"}},
                           {"size", 0.09},
                           {"octaves", 3},
                           {"contrast", 1.3},
                           {"bands", 7},
                           {"seed", 3}});
  scene.Material("iron", {{"kind", "noise"}, {"colors", {"#1f2826", "#4a5552"}}, {"size", 0.03}});
}

void AddPeriodicRoom(SceneBuilder& scene) {
  scene.Material("table", {{"kind", "wood"},
                           {"colors", {"#6b4526", "#c99a63", "#8f6238"}},
                           {"size", {0.5, 0.11}},
                           {"joint", 0.05},
                           {"grain", 0.3},
                           {"grain_size", 0.01}});
  scene.Material(
      "plaster",
      {{"kind", "noise"}, {"colors", {"#8f9a8c", "#c9cdb8", "#a9b39c"}}, {"size", 0.35}, {"octaves", 6}, {"gain", 0.7}, {"bands", 9}});
  scene.Material("brick", {{"kind", "bricks"},
                           {"colors", {"#a8553f", "#914634", "#b8735a"}},
                           {"size", {0.22, 0.075}},
                           {"joint", 0.09},
                           {"joint_color", "#c9bba8"},
                           {"variation", 0.25},
                           {"grain", 0.3},
                           {"grain_size", 0.03}});
  const char* kPosters[][3] = {{"#f0e6c8", "#b02a2a", "#20486e"}, {"#d8402c", "#f2c14e", "#1b2a41"}, {"#2d6e8e", "#f4ecd8", "#7a1f24"}};
  for (int i = 0; i < 3; ++i)
    scene.Material("poster " + std::to_string(i), {{"kind", i == 0 ? "glyphs" : "cells"},
                                                   {"colors", {kPosters[i][0], kPosters[i][1], kPosters[i][2]}},
                                                   {"size", 0.07},
                                                   {"joint", 0.08},
                                                   {"seed", 11 + i}});
  const char* kSpines[] = {"#7a1f24", "#20555a", "#c79a2e", "#3c2a4d", "#1f4d3a", "#b86a3a"};
  for (int i = 0; i < 6; ++i)
    scene.Material("book " + std::to_string(i),
                   {{"kind", "glyphs"}, {"colors", {kSpines[i], "#f2e9cf"}}, {"size", {0.02, 0.03}}, {"seed", 30 + i}});

  scene.Box("table", {2.4, 1.5, 0.05}, 0, 0.05, -0.05)["foreground"] = false;
  scene.Quad("plaster", {5, 3.2}, {0, 1.3, 0.6}, {90, 0, 0});
  scene.Box("brick", {0.5, 0.25, 2.6}, -1.25, 1.15, -1)["foreground"] = false;
  for (int i = 0; i < 3; ++i)
    scene.Box("poster " + std::to_string(i), {0.44, 0.02, 0.6}, -0.65 + 0.62 * i, 1.28, 0.42)["foreground"] = false;
  // Two shelves of books, and some on the table.
  for (int shelf = 0; shelf < 2; ++shelf) {
    const double z = 0.05 + 0.36 * shelf, y = 0.95;
    const double x0 = shelf == 0 ? 0.55 : -1.0;
    if (shelf == 0) scene.Box("table", {0.95, 0.25, 0.03}, x0 + 0.42, y, z - 0.03)["foreground"] = false;
    for (int i = 0; i < 9; ++i)
      if (shelf == 0)
        scene.Box("book " + std::to_string(i % 6), {0.06 + 0.012 * (i * 7 % 4), 0.16, 0.2 + 0.02 * (i * 5 % 4)}, x0 + 0.1 * i, y, z,
                  4.0 * (i % 3) - 4);
  }
  const struct {
    double x, y, h, turn;
  } kOnTable[] = {
      {-0.62, 0.28, 0.09, 25}, {-0.72, -0.18, 0.05, -14}, {0.66, 0.05, 0.12, 38}, {0.48, -0.32, 0.045, 8}, {-0.35, 0.46, 0.2, -8}};
  int i = 0;
  for (const auto& o : kOnTable) scene.Box("book " + std::to_string(i++), {0.22, 0.16, o.h}, o.x, o.y, 0, o.turn)["foreground"] = false;
  scene.Sphere("poster 1", 0.07, 0.38, 0.42, 0.07)["foreground"] = false;
  scene["lights"] = {{{"towards", {-0.5, -0.8, 1.1}}, {"size_deg", 2}, {"color", "#fff6ea"}, {"strength", 0.75}},
                     {{"towards", {0.8, -0.7, 0.5}}, {"color", "#dfe8ff"}, {"strength", 0.25}, {"shadows", false}}};
  scene["ambient"] = {{"sky", "#8c8e94"}, {"ground", "#625c54"}};
  scene["background"] = {{"color", "#3a4048"}};
}

}  // namespace lumi
