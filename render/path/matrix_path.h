// A path of projection matrices: what lumi-stabilize writes. A frame of the result a key; nothing is interpolated.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/model/scene.h"

namespace lumi {

struct MatrixKey {
  double time_s = 0;              // on the path's own clock
  Matrix34d P = Matrix34d::Zero();  // pixels of MatrixPath's size from the scene's world, w > 0 in front
  std::string view;               // the photo that was taken at this moment: its time and exposure are the picture's; may be empty
};

struct MatrixPath {
  std::vector<MatrixKey> keys;    // time ascending
  double fps = 30;
  int width_px = 0, height_px = 0;
};

// Whether the keys of a camera path are matrices. Throws InputError for what is no JSON.
bool IsMatrixPath(const std::filesystem::path& file);
// Throws InputError: the file, and what is wrong with it in one line.
MatrixPath ReadMatrixPath(const std::filesystem::path& file);
void WriteMatrixPath(const std::filesystem::path& file, const MatrixPath& path);

// The photos' own matrices, in the order of their times.
MatrixPath MatrixPathOfPhotos(const Scene& scene, double fps);

// The frames, in the scene's world; other sizes than the path's scale the pixels. Times and exposures are those of the keys' photos,
// else times run on from the scene's earliest. In a metric scene with their centres. Throws DataError for a photo that the scene has not,
// and for a metric scene's view whose centre lies at infinity.
std::vector<RenderView> MatrixViews(const Scene& scene, const MatrixPath& path, int width_px, int height_px);

}  // namespace lumi
