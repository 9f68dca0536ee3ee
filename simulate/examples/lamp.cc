// Thesis, section 7.2.2: a turning lamp filmed by a waved hand-held camera; about 2000 frames, about 150 a turn.
#include "simulate/examples.h"
#include "simulate/examples/periodic_room.h"

namespace lumi {

std::string LampJson() {
  constexpr double kFps = 30, kPeriodS = 150.37 / kFps;
  using Json = SceneBuilder::Json;
  SceneBuilder lamp("lamp");
  lamp["image"] = {{"samples_per_pixel", 4}, {"quality", 95}};
  lamp["cameras"] = {{{"name", "camcorder"}, {"size", {320, 240}}, {"fov_deg", 42}}};
  // Sideways in 1.618 periods: no small whole numbers of both meet within the video.
  lamp["path"] = {{"kind", "wave"},
                  {"views", 2000},
                  {"fps", kFps},
                  {"centre", {0, -1.9, 0.62}},
                  {"look_at", {0, 0, 0.27}},
                  {"amplitude", {0.36, 0.05, 0.05}},
                  {"period_s", 8.11},
                  {"hand", {{"drift", 0.05}, {"shake_deg", 0.6}}}};
  lamp["period_s"] = kPeriodS;
  lamp["fixed_video"] = {{"eye", {0.05, -1.85, 0.6}}, {"target", {0, 0, 0.27}}, {"frames", 1600}};
  lamp["effects"] = {{"noise_sigma", 2}};
  AddPaperAndIron(lamp);
  lamp.Material("red", {{"color", "#e01818"}}, {{"lit", false}});
  lamp.Material("blue ball", {{"kind", "cells"}, {"colors", {"#2038a0", "#4060d0"}}, {"size", 0.03}});
  AddPeriodicRoom(lamp);
  const Json spin = {{"axis", {0, 0, 1}}, {"centre", {0, 0, 0}}, {"period_s", kPeriodS}};
  lamp.Cylinder("iron", 0.09, 0.03, 0, 0, 0);
  lamp.Cylinder("iron", 0.015, 0.5, 0, 0, 0.02);
  Json& shade = lamp.Cylinder("paper", 0.15, 0.26, 0, 0, 0.16);
  shade["top_radius"] = 0.11;
  shade["spin"] = spin;
  lamp.Box("iron", {0.5, 0.012, 0.012}, 0, 0, 0.46)["spin"] = spin;
  lamp.Sphere("red", 0.032, 0.24, 0, 0.43)["spin"] = spin;
  lamp.Sphere("blue ball", 0.04, -0.24, 0, 0.42)["spin"] = spin;
  return lamp.Text();
}

}  // namespace lumi
