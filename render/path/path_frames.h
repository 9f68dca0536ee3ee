// The views of the pictures along a path.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "render/path/camera_path.h"
#include "render/path/matrix_path.h"

namespace lumi {

// Width and height in pixels of a picture. A side of 0 was not asked for and follows from `own`'s aspect; if both are
// 0, the size is `own`.
Eigen::Vector2i SizeFor(int width_px, int height_px, const Eigen::Vector2i& own);

// The views along the path, at the size asked for (0: not asked for), else at the path's own, else as wide as the
// photos but at most 1024. The path's clock begins at the scene's first moment.
std::vector<RenderView> FramesOfPath(const Scene& scene, const CameraPath& path, int width_px, int height_px);
std::vector<RenderView> FramesOfPath(const Scene& scene, const MatrixPath& path, int width_px, int height_px);

}  // namespace lumi
