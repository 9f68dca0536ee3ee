// Thesis, section 5.3.5: a person seen by four cameras on a half circle.
#include "simulate/examples.h"
#include "simulate/examples/scene_builder.h"

namespace lumi {
namespace {

using Json = SceneBuilder::Json;

void PersonMaterials(SceneBuilder& person) {
  person.Material("skin", {{"kind", "noise"}, {"colors", {"#b87a5a", "#cf9472"}}, {"size", 0.05}, {"octaves", 5}},
                  {{"specular", 0.06}, {"shininess", 15}});
  person.Material("hair",
                  {{"kind", "noise"},
                   {"colors", {"#1c120b", "#4a2f1c", "#2a1a10"}},
                   {"size", 0.025},
                   {"octaves", 5},
                   {"gain", 0.7}},
                  {{"specular", 0.12}, {"shininess", 20}});
  person.Material("shirt", {{"kind", "tiles"},
                            {"colors", {"#9c2f2a", "#b5493c", "#6e1f22", "#d8c9a8", "#34405c"}},
                            {"size", {0.055, 0.055}},
                            {"joint", 0.16},
                            {"joint_color", "#1f2436"},
                            {"grain", 0.3},
                            {"grain_size", 0.006}});
  person.Material("denim", {{"kind", "noise"},
                            {"colors", {"#1f3352", "#35557f", "#2a4468"}},
                            {"size", 0.04},
                            {"octaves", 6},
                            {"gain", 0.75},
                            {"grain", 0.25},
                            {"grain_size", 0.004}});
  person.Material("leather", {{"kind", "noise"}, {"colors", {"#2e1c12", "#53351f"}}, {"size", 0.02}},
                  {{"specular", 0.25}, {"shininess", 40}});
  person.Material("sole", {{"color", "#d8d0c0"}});
  person.Material("white", {{"color", "#f0ece6"}});
  person.Material("dark", {{"color", "#1a1412"}});
  person.Material("lips", {{"color", "#9a4a44"}});
  person.Material("brass", {{"color", "#b8964a"}}, {{"specular", 0.6}, {"shininess", 60}, {"mirror", 0.2}});
  person.Material("bag", {{"kind", "cells"},
                          {"colors", {"#3f6a4a", "#55825a", "#2f4f3a", "#c8a24a"}},
                          {"size", 0.03},
                          {"joint", 0.1},
                          {"joint_color", "#1a2a1e"}});
}

Json& Ellipsoid(SceneBuilder& person, const char* material, double x, double y, double z, double rx, double ry,
                double rz) {
  Json& ball = person.Sphere(material, rz, x, y, z);
  ball["scale"] = {rx / rz, ry / rz, 1};
  return ball;
}

}  // namespace

std::string PersonJson() {
  SceneBuilder person("person");
  person["cameras"] = {{{"name", "stage"}, {"size", {480, 640}}, {"fov_deg", 30}}};
  // The person looks along -y.
  person["path"] = {{"kind", "half-circle"}, {"views", 4},       {"centre", {0, 0, 0.90}}, {"radius", 3.1},
                    {"height", 0.35},        {"start_deg", 180}, {"look_at", {0, 0, 0.90}}};
  PersonMaterials(person);
  for (const int side : {-1, 1}) {
    const double s = side;
    const double step = 0.05 * s;  // one foot before the other
    person.Loft("denim",
                {{0.115 * s, step, 0.09, 0.062, 0.068},
                 {0.112 * s, step, 0.30, 0.062, 0.070},
                 {0.108 * s, 0.5 * step, 0.50, 0.068, 0.072},
                 {0.10 * s, 0.2 * step, 0.72, 0.088, 0.095},
                 {0.092 * s, 0, 0.93, 0.10, 0.112}},
                {0, 1, 0}, 2.2);
    Ellipsoid(person, "leather", 0.12 * s, step - 0.055, 0.055, 0.050, 0.135, 0.052);
    person.Loft("sole", {{0.12 * s, step - 0.055, 0.0, 0.050, 0.134}, {0.12 * s, step - 0.055, 0.022, 0.052, 0.137}},
                {0, 1, 0}, 2.6);
    // Sleeve, forearm, hand: arms hang a little away from the body.
    person.Loft("shirt",
                {{0.185 * s, 0.005, 1.44, 0.058, 0.066},
                 {0.225 * s, 0.005, 1.37, 0.060, 0.064},
                 {0.265 * s, 0.01, 1.22, 0.052, 0.054},
                 {0.295 * s, 0.0, 1.08, 0.046, 0.048}},
                {0, 1, 0}, 2.1);
    person.Loft("skin",
                {{0.294 * s, 0.0, 1.085, 0.039, 0.041},
                 {0.312 * s, -0.03, 0.97, 0.036, 0.037},
                 {0.322 * s, -0.06, 0.86, 0.026, 0.029}},
                {0, 1, 0});
    Ellipsoid(person, "skin", 0.325 * s, -0.075, 0.80, 0.026, 0.042, 0.072);
    Ellipsoid(person, "skin", 0.302 * s, -0.108, 0.825, 0.014, 0.016, 0.04);
    // Face.
    Ellipsoid(person, "white", 0.033 * s, -0.083, 1.655, 0.016, 0.012, 0.010);
    Ellipsoid(person, "dark", 0.033 * s, -0.092, 1.655, 0.0075, 0.006, 0.0078);
    Ellipsoid(person, "hair", 0.034 * s, -0.088, 1.680, 0.021, 0.010, 0.005);
    Ellipsoid(person, "skin", 0.079 * s, 0.008, 1.645, 0.012, 0.022, 0.032);
  }
  person.Loft("denim", {{0, 0.0, 0.84, 0.16, 0.105}, {0, 0.0, 0.92, 0.178, 0.122}, {0, 0.0, 1.0, 0.166, 0.112}},
              {0, 1, 0}, 2.3);
  person.Loft("leather", {{0, 0.0, 0.985, 0.171, 0.117}, {0, 0.0, 1.02, 0.168, 0.114}}, {0, 1, 0}, 2.3);
  person.Box("brass", {0.05, 0.02, 0.034}, 0, -0.113, 0.986);
  person.Loft("shirt",
              {{0, 0.0, 1.0, 0.162, 0.110},
               {0, 0.0, 1.12, 0.160, 0.108},
               {0, 0.0, 1.28, 0.185, 0.122},
               {0, 0.005, 1.40, 0.198, 0.115},
               {0, 0.01, 1.465, 0.165, 0.085},
               {0, 0.012, 1.495, 0.085, 0.066}},
              {0, 1, 0}, 2.4);
  person.Loft("skin", {{0, 0.012, 1.47, 0.056, 0.058}, {0, 0.008, 1.60, 0.050, 0.054}}, {0, 1, 0});
  Ellipsoid(person, "skin", 0, 0.0, 1.645, 0.077, 0.096, 0.115);
  Ellipsoid(person, "skin", 0, -0.030, 1.585, 0.050, 0.058, 0.055);
  Ellipsoid(person, "skin", 0, -0.102, 1.630, 0.013, 0.020, 0.022);
  Ellipsoid(person, "lips", 0, -0.088, 1.588, 0.024, 0.010, 0.007);
  Ellipsoid(person, "hair", 0, 0.022, 1.682, 0.086, 0.100, 0.095);
  Ellipsoid(person, "hair", 0.01, -0.045, 1.742, 0.066, 0.050, 0.030);
  // A bag on the left hip with its strap.
  person.Box("bag", {0.10, 0.24, 0.20}, 0.235, 0.06, 0.86, 8);
  person.Loft("leather",
              {{0.215, 0.10, 1.02, 0.012, 0.016},
               {0.12, 0.128, 1.22, 0.012, 0.016},
               {-0.06, 0.112, 1.42, 0.012, 0.016},
               {-0.125, 0.04, 1.50, 0.012, 0.016}},
              {0, 1, 0});
  person["lights"] = {{{"towards", {-0.5, -0.9, 1.0}}, {"size_deg", 3}, {"color", "#fff6ea"}, {"strength", 0.7}},
                      {{"towards", {0.9, -0.3, 0.5}}, {"color", "#dfe8ff"}, {"strength", 0.3}, {"shadows", false}}};
  person["ambient"] = {{"sky", "#94969c"}, {"ground", "#6a6660"}};
  person["background"] = {{"color", "#3f7f5a"}};
  person["environment"] = {{"zenith", "#ffffff"}, {"horizon", "#808890"}, {"ground", "#303030"}};
  return person.Text();
}

}  // namespace lumi
