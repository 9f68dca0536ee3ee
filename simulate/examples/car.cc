// Thesis, section 5.3.4: 36 photos of a car, ten degrees apart on a circle, nothing else in the picture.
#include "simulate/examples.h"
#include "simulate/examples/scene_builder.h"

namespace lumi {
namespace {

using Json = SceneBuilder::Json;
constexpr double kWheelX[2] = {-1.28, 1.34};  // rear, front; metres, the car looks along x
constexpr double kWheelRadius = 0.33;

void CarMaterials(SceneBuilder& car) {
  car.Material("paint", {{"kind", "noise"}, {"colors", {"#9c1410", "#b01a14"}}, {"size", 0.02}, {"octaves", 2}},
               {{"specular", 0.7}, {"shininess", 220}, {"mirror", 0.05}});
  car.Material("stripe", {{"color", "#efeae0"}}, {{"specular", 0.6}, {"shininess", 200}, {"mirror", 0.05}});
  car.Material("number", {{"kind", "glyphs"}, {"colors", {"#f4f0e6", "#101014"}}, {"size", {0.10, 0.15}}, {"seed", 6}},
               {{"specular", 0.4}, {"shininess", 150}});
  car.Material("glass", {{"color", "#15191d"}}, {{"specular", 0.9}, {"shininess", 400}, {"mirror", 0.12}});
  car.Material("rubber", {{"kind", "noise"}, {"colors", {"#121212", "#242424"}}, {"size", 0.03}});
  car.Material("black", {{"color", "#0d0d0f"}});
  car.Material("alloy", {{"kind", "noise"}, {"colors", {"#8e9297", "#b4b8bd"}}, {"size", 0.05}},
               {{"specular", 0.8}, {"shininess", 80}, {"mirror", 0.25}});
  car.Material(
      "grille",
      {{"kind", "tiles"}, {"colors", {"#0c0c0e"}}, {"size", 0.055}, {"joint", 0.25}, {"joint_color", "#6e7276"}});
  car.Material("headlight",
               {{"kind", "cells"},
                {"colors", {"#dfe6ea", "#b7c3cb", "#f2f6f8"}},
                {"size", 0.03},
                {"joint", 0.06},
                {"joint_color", "#7a868e"}},
               {{"specular", 1.0}, {"shininess", 300}, {"mirror", 0.1}});
  car.Material("taillight",
               {{"kind", "tiles"},
                {"colors", {"#8c0d0a", "#a8150f"}},
                {"size", 0.04},
                {"joint", 0.08},
                {"joint_color", "#4a0604"}},
               {{"specular", 0.8}, {"shininess", 200}});
  car.Material("plate",
               {{"kind", "glyphs"}, {"colors", {"#f2f2ec", "#10203c"}}, {"size", {0.065, 0.12}}, {"seed", 17}});
}

void Wheel(SceneBuilder& car, double x, int side) {
  // Cylinders stand on z; turned about x their top looks along -y.
  const auto disc = [&](const char* material, double radius, double outer, double depth) {
    const double y = side < 0 ? -outer + depth : outer;
    car.Cylinder(material, radius, depth, x, y, kWheelRadius)["rotate_deg"] = {90, 0, 0};
  };
  disc("black", kWheelRadius + 0.065, 0.868, 0.30);
  disc("rubber", kWheelRadius, 0.885, 0.24);
  disc("alloy", 0.215, 0.892, 0.05);
  disc("black", 0.185, 0.895, 0.05);
  for (int i = 0; i < 5; ++i) {
    Json& spoke = car.Box("alloy", {0.37, 0.03, 0.05}, x, side * 0.893, kWheelRadius - 0.025);
    spoke["rotate_deg"] = {0, 36 * i, 0};
    spoke["position"] = {x, side * 0.888, kWheelRadius};
  }
  disc("alloy", 0.06, 0.912, 0.04);
}

}  // namespace

std::string CarJson() {
  SceneBuilder car("car");
  car["cameras"] = {{{"name", "studio"}, {"size", {640, 480}}, {"fov_deg", 45}}};
  car["path"] = {{"kind", "ring"}, {"views", 36},    {"centre", {0, 0, 0.62}},
                 {"radius", 6.0},  {"height", 1.55}, {"look_at", {0, 0, 0.62}}};
  CarMaterials(car);
  // Sections along the car: x, y, z of the middle, half width, half height.
  car.Loft("paint",
           {{-2.12, 0, 0.62, 0.60, 0.19},
            {-2.02, 0, 0.64, 0.76, 0.27},
            {-1.45, 0, 0.645, 0.855, 0.315},
            {-0.5, 0, 0.625, 0.875, 0.315},
            {0.6, 0, 0.605, 0.875, 0.295},
            {1.35, 0, 0.575, 0.855, 0.265},
            {1.85, 0, 0.53, 0.79, 0.215},
            {2.08, 0, 0.49, 0.66, 0.155},
            {2.14, 0, 0.47, 0.55, 0.11}},
           {0, 0, 1}, 3.6)["segments"] = 128;
  const Json cabin = {{-1.86, 0, 0.90, 0.60, 0.04},   {-1.35, 0, 1.02, 0.675, 0.25}, {-0.70, 0, 1.08, 0.71, 0.325},
                      {-0.05, 0, 1.08, 0.715, 0.325}, {0.45, 0, 1.0, 0.70, 0.22},    {1.08, 0, 0.86, 0.66, 0.03}};
  car.Loft("glass", cabin, {0, 0, 1}, 3.2);
  // Roof and pillars: slices of the cabin, a little larger.
  car.Loft("paint",
           {{-1.24, 0, 1.298, 0.49, 0.025},
            {-0.98, 0, 1.360, 0.52, 0.027},
            {-0.70, 0, 1.389, 0.545, 0.028},
            {-0.05, 0, 1.386, 0.55, 0.028},
            {0.20, 0, 1.327, 0.53, 0.022}},
           {0, 0, 1}, 3.2);
  car.Loft("paint", {{-0.62, 0, 1.08, 0.722, 0.333}, {-0.50, 0, 1.08, 0.722, 0.335}}, {0, 0, 1}, 3.2);
  car.Loft("paint", {{-1.42, 0, 1.01, 0.672, 0.238}, {-1.22, 0, 1.035, 0.694, 0.274}}, {0, 0, 1}, 3.2);
  // Two stripes along bonnet, roof and boot.
  for (const double y : {-0.16, 0.16}) {
    car.Loft("stripe",
             {{1.18, y, 0.852, 0.09, 0.022},
              {1.6, y, 0.778, 0.09, 0.025},
              {1.96, y, 0.665, 0.09, 0.022},
              {2.09, y, 0.615, 0.09, 0.022}},
             {0, 0, 1}, 6);
    car.Loft("stripe",
             {{-1.22, y, 1.311, 0.09, 0.018},
              {-0.98, y, 1.371, 0.09, 0.02},
              {-0.70, y, 1.400, 0.09, 0.021},
              {-0.05, y, 1.397, 0.09, 0.021},
              {0.19, y, 1.336, 0.09, 0.018}},
             {0, 0, 1}, 6);
  }
  for (const double x : kWheelX)
    for (const int side : {-1, 1}) Wheel(car, x, side);
  for (const int side : {-1, 1}) {
    Json& light = car.Sphere("headlight", 0.11, 1.96, side * 0.56, 0.60);
    light["scale"] = {1.1, 1.3, 0.75};
    Json& tail = car.Sphere("taillight", 0.10, -2.06, side * 0.60, 0.74);
    tail["scale"] = {0.5, 1.5, 0.8};
    Json& mirror = car.Sphere("paint", 0.08, 0.62, side * 0.80, 0.98);
    mirror["scale"] = {0.8, 1.35, 0.85};
    car.Box("black", {0.02, 0.02, 0.30}, 0.22, side * 0.873, 0.45);  // edge of the door
    car.Box("black", {0.02, 0.02, 0.30}, -0.62, side * 0.873, 0.45);
    car.Box("alloy", {0.15, 0.03, 0.03}, -0.48, side * 0.880, 0.76);  // handle
    Json& roundel = car.Cylinder("number", 0.17, 0.02, -0.18, side < 0 ? -0.87 : 0.89, 0.60);
    roundel["rotate_deg"] = {90, 0, side < 0 ? 0 : 180};
    if (side > 0) roundel["position"] = {-0.18, 0.87, 0.60};
    car.Box("black", {1.9, 0.03, 0.09}, 0.02, side * 0.83, 0.29);  // sill
  }
  car.Box("grille", {0.03, 0.72, 0.14}, 2.125, 0, 0.42);
  car.Box("plate", {0.02, 0.44, 0.11}, 2.15, 0, 0.385);
  car.Box("plate", {0.02, 0.44, 0.11}, -2.13, 0, 0.58);
  car.Box("black", {0.10, 1.1, 0.08}, -2.07, 0, 0.42);
  car.Cylinder("alloy", 0.035, 0.12, -2.16, 0.45, 0.34)["rotate_deg"] = {0, 90, 0};
  car["lights"] = {{{"towards", {0.4, -0.6, 1.0}}, {"size_deg", 2}, {"color", "#fffaf2"}, {"strength", 0.75}},
                   {{"towards", {-0.7, 0.5, 0.7}}, {"color", "#dfe8ff"}, {"strength", 0.3}, {"shadows", false}}};
  car["ambient"] = {{"sky", "#a4a8ae"}, {"ground", "#686868"}};
  car["background"] = {{"color", "#8fa3b5"}};
  car["environment"] = {{"zenith", "#ffffff"}, {"horizon", "#9aa4ae"}, {"ground", "#3a3c40"}};
  return car.Text();
}

}  // namespace lumi
