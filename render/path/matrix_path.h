// A path of projection matrices (scene/files/matrix_path.h) as the views that it is rendered from.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "scene/files/matrix_path.h"
#include "scene/model/scene.h"

namespace lumi {

// The photos' own matrices, in the order of their times.
MatrixPath MatrixPathOfPhotos(const Scene& scene, double fps);

// The path of matrices in `file`; without a file the photos' own, at this rate, where the scene has no poses. nullopt:
// the path is one of poses. Throws DataError for a path of poses in a scene that has none, InputError.
std::optional<MatrixPath> MatrixPathFor(const Scene& scene, const std::filesystem::path& file, double fps);

// The frames, in the scene's world; other sizes than the path's scale the pixels. Times and exposures are those of the
// keys' photos, else times run on from the scene's earliest. In a metric scene with their centres. Throws DataError for
// a photo that the scene has not, and for a metric scene's view whose centre lies at infinity.
std::vector<RenderView> MatrixViews(const Scene& scene, const MatrixPath& path, int width_px, int height_px);

}  // namespace lumi
