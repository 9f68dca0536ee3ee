// Thesis, section 6.5.3: a toy bear that should keep its size while the camera, held by hand, moves in and zooms out.
#include "simulate/examples.h"
#include "simulate/examples/periodic_room.h"

namespace lumi {
namespace {

using VertigoPart = SceneBuilder::Json;

// The bear sits on the table at the origin and looks along -y; about 0.6 m high.
void AddBear(SceneBuilder& scene) {
  scene.Material("fur", {{"kind", "noise"},
                         {"colors", {"#5a3317", "#c08a4c", "#8a5628", "#e0b878", "#6f4420"}},
                         {"size", 0.05},
                         {"octaves", 5},
                         {"gain", 0.6},
                         {"bands", 8},
                         {"contrast", 1.2},
                         {"seed", 21}});
  scene.Material("muzzle", {{"kind", "cells"}, {"colors", {"#e8d2a8", "#f4e6c6", "#d8b888"}}, {"size", 0.014}, {"seed", 5}});
  scene.Material("black", {{"color", "#15110e"}}, {{"specular", 0.5}, {"shininess", 60}});
  scene.Material("scarf", {{"kind", "checker"}, {"colors", {"#b01f24", "#f0e4d0"}}, {"size", 0.022}});
  const auto ellipsoid = [&](const char* material, double x, double y, double z, double rx, double ry, double rz) {
    VertigoPart& ball = scene.Sphere(material, rz, x, y, z);
    ball["scale"] = {rx / rz, ry / rz, 1};
  };
  ellipsoid("fur", 0, 0.02, 0.2, 0.15, 0.13, 0.2);
  ellipsoid("muzzle", 0, -0.075, 0.17, 0.08, 0.045, 0.1);
  scene.Cylinder("scarf", 0.105, 0.05, 0, 0.01, 0.35)["top_radius"] = 0.09;
  ellipsoid("fur", 0, 0, 0.48, 0.13, 0.115, 0.115);
  ellipsoid("muzzle", 0, -0.1, 0.45, 0.055, 0.05, 0.042);
  ellipsoid("black", 0, -0.15, 0.468, 0.018, 0.012, 0.013);
  for (const double side : {-1.0, 1.0}) {
    ellipsoid("fur", 0.1 * side, 0.01, 0.575, 0.045, 0.025, 0.045);
    ellipsoid("muzzle", 0.1 * side, -0.012, 0.575, 0.026, 0.012, 0.026);
    ellipsoid("black", 0.045 * side, -0.102, 0.505, 0.012, 0.01, 0.014);
    scene.Loft("fur", {{0.13 * side, 0, 0.34, 0.05, 0.05}, {0.19 * side, -0.05, 0.25, 0.048, 0.048}, {0.2 * side, -0.1, 0.18, 0.04, 0.04}}, {0, 1, 0});
    scene.Loft("fur", {{0.09 * side, -0.02, 0.075, 0.07, 0.07}, {0.14 * side, -0.14, 0.07, 0.06, 0.065}, {0.165 * side, -0.21, 0.07, 0.05, 0.066}}, {0, 0, 1});
    ellipsoid("muzzle", 0.17 * side, -0.225, 0.072, 0.042, 0.016, 0.052);
  }
}

}  // namespace

std::string VertigoJson() {
  SceneBuilder scene("vertigo");
  scene["cameras"] = {{{"name", "camcorder"}, {"size", {480, 360}}, {"fov_deg", 22}}};
  scene["path"] = {{"kind", "drive"},
                   {"views", 240},
                   {"fps", 30},
                   {"from", {0.1, -4.4, 0.75}},
                   {"to", {0.04, -1.75, 0.52}},
                   {"look_at", {0, 0, 0.3}},
                   {"hold", {0, 0, 0.3}},
                   {"gait", {{"step_hz", 1.6}, {"bob", 0.012}, {"sway", 0.012}, {"shake_deg", 0.8}, {"pace_s", 0.5}, {"zoom_percent", 5}}}};
  AddPaperAndIron(scene);
  AddPeriodicRoom(scene);
  scene.Material("boards", {{"kind", "wood"}, {"colors", {"#4a3220", "#7d5a3a", "#64462c"}}, {"size", {1.4, 0.14}}, {"joint", 0.04}, {"grain", 0.3}, {"grain_size", 0.02}});
  scene.Quad("boards", {8, 8}, {0, -1.5, -1}, {0, 0, 0});
  // Things nearer than the bear, which grow while the wall shrinks.
  scene.Box("book 1", {0.2, 0.14, 0.1}, -0.55, -0.52, 0, 20)["foreground"] = false;
  scene.Cylinder("poster 2", 0.06, 0.16, 0.5, -0.5, 0)["foreground"] = false;
  AddBear(scene);
  return scene.Text();
}

}  // namespace lumi
