// PATH.json: a path of projection matrices, one a frame of the result (docs/stabilize.md). lumi-render and the viewer read it.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/geometry/projection.h"

namespace lumi {

// Where a pixel of the photo went: what the next window of a long video takes over from this one.
struct Anchor {
  Eigen::Vector2d from_px = Eigen::Vector2d::Zero(), to_px = Eigen::Vector2d::Zero();
};

struct MatrixKey {
  double time_s = 0;
  Matrix34d P = Matrix34d::Zero();   // pixels from the scene's world, w > 0 in front
  std::string view;                  // the photo that was taken then
  std::vector<Anchor> anchors;       // empty: none were asked for
};

struct MatrixPath {
  double fps = 30;
  Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
  std::vector<MatrixKey> keys;
  std::string model;
  double view_scale = 1;             // the largest centred part of every picture that its frames see, before any cropping
  bool cropped = false;              // to it: P has it in it
};

std::string MatrixPathJson(const MatrixPath& path);
// Throws InputError naming the file and what is wrong.
MatrixPath ReadMatrixPath(const std::filesystem::path& file);

}  // namespace lumi
