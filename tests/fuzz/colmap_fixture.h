// A COLMAP model of which one file is the input: its first byte says which, the others are as they should be.
#pragma once

#include <array>
#include <cmath>
#include <string>
#include <string_view>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/seeds.h"

namespace lumi::fuzz {

template <ColmapFormat format>
void ReadModelWith(std::string_view bytes) {
  static const std::string ending = format == ColmapFormat::kText ? ".txt" : ".bin";
  static const std::string model = "model" + ending;
  static const std::filesystem::path folder = [] {
    WriteColmapModel(SeedScene(), InputFolder() / model, format);
    return InputFolder() / model;
  }();
  static const std::array<std::string, 3> names{"cameras", "images", "points3D"};
  static const std::array<std::string, 3> right{ReadText(folder / (names[0] + ending)),
                                                ReadText(folder / (names[1] + ending)),
                                                ReadText(folder / (names[2] + ending))};
  if (bytes.empty()) return;
  const auto which = static_cast<std::size_t>(static_cast<unsigned char>(bytes.front())) % names.size();
  InputFile(model + "/" + names[which] + ending, bytes.substr(1));
  struct PutBack {
    std::size_t which;
    ~PutBack() { InputFile(model + "/" + names[which] + ending, right[which]); }
  } put_back{which};
  const Scene scene = ReadColmapModel(folder);
  for (const Camera& c : scene.cameras) Require(!Validate(c), "a camera that is none was accepted");
  for (const View& v : scene.views) {
    Require(static_cast<std::size_t>(v.camera.value) < scene.cameras.size(), "a view has no camera");
    Require(v.cam_from_world.translation.allFinite(), "a pose is not finite");
    Require(std::abs(v.cam_from_world.rotation.norm() - 1) < 1e-6, "a rotation is no unit quaternion");
  }
  for (const Point& p : scene.points) {
    Require(p.x_in_world.allFinite(), "a point is not finite");
    for (const Observation& o : p.track)
      Require(static_cast<std::size_t>(o.view.value) < scene.views.size() && o.x_px.allFinite(),
              "an observation leads nowhere");
  }
}

}  // namespace lumi::fuzz
