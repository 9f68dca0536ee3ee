// Thesis, section 7.2.2: a helicopter with turning blades; about 900 frames, about 15 a turn, blurred as a camcorder does.
#include "simulate/examples.h"
#include "simulate/examples/periodic_room.h"

namespace lumi {

std::string HelicopterJson() {
  constexpr double kFps = 30, kPeriodS = 15.37 / kFps;
  using Json = SceneBuilder::Json;
  SceneBuilder heli("helicopter");
  heli["image"] = {{"samples_per_pixel", 16}, {"quality", 95}};
  heli["cameras"] = {{{"name", "camcorder"}, {"size", {320, 240}}, {"fov_deg", 42}}};
  heli["path"] = {{"kind", "wave"},
                  {"views", 900},
                  {"fps", kFps},
                  {"centre", {0, -1.8, 0.85}},
                  {"look_at", {0, 0, 0.2}},
                  {"amplitude", {0.34, 0.05, 0.05}},
                  {"period_s", 4.415},
                  {"hand", {{"drift", 0.05}, {"shake_deg", 0.6}}}};
  heli["period_s"] = kPeriodS;
  heli["fixed_video"] = {{"eye", {0.05, -1.75, 0.83}}, {"target", {0, 0, 0.2}}, {"frames", 310}};
  // Exposed for a quarter of a frame: the tips move by 6 degrees meanwhile.
  heli["effects"] = {{"noise_sigma", 2}, {"motion_blur_s", 0.25 / kFps}};
  heli.Material("body", {{"kind", "noise"}, {"colors", {"#3f6a4a", "#5f8a5a", "#8fae6a", "#2f4f3a"}}, {"size", 0.08}, {"bands", 6}});
  heli.Material("glass", {{"color", "#203848"}}, {{"specular", 0.5}, {"shininess", 50}});
  heli.Material("metal", {{"kind", "noise"}, {"colors", {"#505860", "#7a848c"}}, {"size", 0.02}});
  heli.Material("blade", {{"color", "#2a2a30"}});
  heli.Material("other blade", {{"color", "#6a3020"}});
  heli.Material("tip", {{"color", "#f0d020"}}, {{"lit", false}});
  heli.Material("other tip", {{"color", "#f0f0f0"}}, {{"lit", false}});
  AddPeriodicRoom(heli);
  heli.Loft("body",
            {{-0.18, 0, 0.13, 0.02, 0.03},
             {-0.13, 0, 0.15, 0.07, 0.08},
             {0, 0, 0.17, 0.09, 0.1},
             {0.12, 0, 0.19, 0.05, 0.06},
             {0.2, 0, 0.2, 0.02, 0.025},
             {0.42, 0, 0.24, 0.012, 0.016}},
            {0, 0, 1}, 2.3);
  heli.Sphere("glass", 0.07, -0.12, 0, 0.16);
  for (const double y : {-0.09, 0.09}) {
    heli.Box("metal", {0.4, 0.015, 0.012}, -0.02, y, 0);
    for (const double x : {-0.1, 0.08}) heli.Box("metal", {0.012, 0.012, 0.1}, x, 0.8 * y, 0.01);
  }
  heli.Cylinder("metal", 0.012, 0.09, 0, 0, 0.25);
  // Two blades of other colours: half a turn looks alike, and is not the same.
  const Json spin = {{"axis", {0, 0, 1}}, {"centre", {0, 0, 0}}, {"period_s", kPeriodS}};
  heli.Box("blade", {0.3, 0.035, 0.008}, 0.17, 0, 0.335)["spin"] = spin;
  heli.Box("other blade", {0.3, 0.035, 0.008}, -0.17, 0, 0.335)["spin"] = spin;
  heli.Box("tip", {0.07, 0.037, 0.01}, 0.35, 0, 0.334)["spin"] = spin;
  heli.Box("other tip", {0.07, 0.037, 0.01}, -0.35, 0, 0.334)["spin"] = spin;
  heli.Box("metal", {0.012, 0.02, 0.1}, 0.42, -0.02, 0.2);
  return heli.Text();
}

}  // namespace lumi
