// PATH.json: a path of projection matrices, one a frame of the result (docs/stabilize.md). lumi-stabilize writes it,
// lumi-render and the viewer read it; nothing is interpolated.
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
  double time_s = 0;                // on the path's own clock
  Matrix34d P = Matrix34d::Zero();  // pixels of the path's size from the scene's world, w > 0 in front
  std::string view;  // the photo that was taken at this moment: its time and exposure are the picture's; may be empty
  double view_scale =
      1;  // of a stabilised path: the largest centred part of the picture that its frames see, before any cropping
  std::vector<Anchor> anchors;  // empty: none were asked for
  // With anchors, of a scene with structure: the frame's matrix as filmed and P in units from the path's balanced world
  // (stabilize/filmed_scene.h); zero: none.
  Matrix34d filmed = Matrix34d::Zero(), steady = Matrix34d::Zero();
};

struct MatrixPath {
  std::vector<MatrixKey> keys;  // time ascending
  double fps = 30;
  int width_px = 0, height_px = 0;
  // Of a stabilised path.
  std::string model;              // empty: it is none
  double view_scale = 1;          // the least of the keys'
  bool cropped = false;           // to view_scale; P then includes the crop
  std::vector<double> object_px;  // x, y, width, height of what it keeps in place, before any cropping; empty: nothing,
                                  // or no window follows

  Eigen::Vector2i size_px() const { return {width_px, height_px}; }
};

// Whether the keys of a camera path are matrices. Throws InputError for what is no JSON.
bool IsMatrixPath(const std::filesystem::path& file);
// Throws InputError: the file, and what is wrong with it in one line.
MatrixPath ReadMatrixPath(const std::filesystem::path& file);
// Atomically.
void WriteMatrixPath(const std::filesystem::path& file, const MatrixPath& path);

}  // namespace lumi
