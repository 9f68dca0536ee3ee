// The example of a turning lamp, as fast and as coarse as a test can wait for.
#pragma once

#include <nlohmann/json.hpp>

#include "simulate/examples.h"

namespace lumi {

// One ray a pixel, hard shadows, thirty frames a second, a turn in `period_frames` of them.
inline nlohmann::json QuickLamp(int width_px, int height_px, double period_frames) {
  nlohmann::json scene = nlohmann::json::parse(ExampleJson("lamp"));
  scene["image"] = {{"samples_per_pixel", 1}};
  scene["cameras"][0]["size"] = {width_px, height_px};
  scene["period_s"] = period_frames / 30;
  for (nlohmann::json& object : scene["objects"])
    if (object.contains("spin")) object["spin"]["period_s"] = period_frames / 30;
  for (nlohmann::json& light : scene["lights"]) light.erase("size_deg");
  return scene;
}

}  // namespace lumi
