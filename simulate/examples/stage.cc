// A scene for several cameras at once (thesis, section 7.1): nothing repeats within the videos, so their order in time is in the pictures.
#include <cmath>

#include "simulate/examples.h"
#include "simulate/examples/periodic_room.h"

namespace lumi {

std::string StageJson() {
  constexpr double kFps = 30;
  constexpr int kCameras = 8, kFrames = 90;
  constexpr int kStarts[kCameras] = {9, 0, 14, 3, 21, 7, 12, 5};
  using Json = SceneBuilder::Json;
  SceneBuilder stage("stage");
  stage["image"] = {{"samples_per_pixel", 4}, {"quality", 95}};
  stage["cameras"] = {{{"name", "tripod"}, {"size", {320, 240}}, {"fov_deg", 46}}};
  // The photos are the cameras' at the clock's beginning.
  Json poses = Json::array(), videos = Json::array();
  for (int c = 0; c < kCameras; ++c) {
    const double angle = (-35 + 70.0 * c / (kCameras - 1)) * M_PI / 180;
    const Json eye = {1.95 * std::sin(angle), -1.95 * std::cos(angle), 0.55 + 0.12 * (c % 2)}, target = {0, 0.05, 0.27};
    poses.push_back({{"eye", eye}, {"target", target}});
    videos.push_back({{"eye", eye}, {"target", target}, {"frames", kFrames}, {"start_frame", kStarts[c]}});
  }
  stage["path"] = {{"kind", "poses"}, {"poses", poses}, {"fps", kFps}};
  stage["videos"] = videos;
  stage["effects"] = {{"noise_sigma", 2}};
  AddPaperAndIron(stage);
  stage.Material("ball", {{"kind", "cells"}, {"colors", {"#2038a0", "#e0d060"}}, {"size", 0.03}});
  AddPeriodicRoom(stage);
  const Json slow = {{"axis", {0, 0, 1}}, {"centre", {-0.2, 0.05, 0}}, {"period_s", 5.9}, {"unsteady", 1}}, fast = {{"axis", {0, 0, 1}}, {"centre", {0.25, 0, 0}}, {"period_s", 1.83}, {"unsteady", 1}};
  Json& shade = stage.Cylinder("paper", 0.13, 0.3, -0.2, 0.05, 0.08);
  shade["top_radius"] = 0.09;
  shade["spin"] = slow;
  stage.Box("iron", {0.36, 0.02, 0.02}, -0.2, 0.05, 0.4)["spin"] = slow;
  stage.Sphere("ball", 0.05, -0.02, 0.05, 0.36)["spin"] = slow;
  stage.Cylinder("iron", 0.015, 0.3, 0.25, 0, 0);
  stage.Box("paper", {0.34, 0.05, 0.03}, 0.25, 0, 0.3)["spin"] = fast;
  stage.Sphere("ball", 0.045, 0.4, 0, 0.34)["spin"] = fast;
  return stage.Text();
}

}  // namespace lumi
