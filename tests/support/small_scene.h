// A scene small enough for a unit test: cameras on an arc before a wall of points, photos of flat colour.
#pragma once

#include <cmath>
#include <filesystem>
#include <string>

#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/model/scene.h"

namespace lumi {

inline Scene MakeSmallScene(const std::filesystem::path& image_folder, int views) {
  Scene scene;
  scene.cameras.push_back(Camera::Pinhole(64, 48, 60, 60, 32, 24));
  for (int i = 0; i < views; ++i) {
    View view;
    view.name = "photo" + std::to_string(10 + i) + ".png";
    view.camera = CameraId{0};
    const double angle_rad = 0.2 * (i - views / 2);
    view.cam_from_world = LookAt({4 * std::sin(angle_rad), 0, -4 * std::cos(angle_rad)}, {0, 0, 0}, {0, -1, 0});
    scene.views.push_back(view);
    WriteImage(image_folder / view.name, Image8(64, 48, 3, static_cast<std::uint8_t>(20 * i + 10)));
  }
  for (int i = 0; i < 40; ++i) {
    Point point;
    point.x_in_world = {std::fmod(i * 0.37, 2.0) - 1, std::fmod(i * 0.61, 1.5) - 0.75, 0.1 * std::sin(i)};
    point.error_px = 0.5;
    for (int v = 0; v < views; ++v) {
      const View& view = scene.views[static_cast<std::size_t>(v)];
      point.track.push_back({ViewId{v}, *scene.cameras[0].Project(view.cam_from_world * point.x_in_world)});
    }
    scene.points.push_back(point);
  }
  scene.image_folder = image_folder;
  UpdateFrameOfReference(scene);
  return scene;
}

}  // namespace lumi
