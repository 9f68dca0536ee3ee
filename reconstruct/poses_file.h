// Files with known cameras: a COLMAP model, transforms.json, Middlebury's *_par.txt, or twelve numbers a line.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/options.h"
#include "scene/geometry/projection.h"
#include "scene/geometry/rigid3.h"
#include "scene/model/camera.h"

namespace lumi {

struct PosedCamera {
  std::string name;                  // as the file has it; empty in a list without names
  std::optional<Camera> camera;      // where the file tells lens and photo size
  std::optional<Eigen::Matrix3d> K;  // where it tells a matrix only; K(2,2) = 1
  Rigid3 cam_from_world;
};

// Throws InputError naming file and line: wrong counts, not finite, not a rotation, a singular projection matrix; and
// UsageError where the meaning of twelve numbers must be told (format unset).
std::vector<PosedCamera> ReadPosesFile(const std::filesystem::path& path, PosesFormat format);

// P = s K [R | t] with K upper triangular, its diagonal positive, and w > 0 in front (Hartley & Zisserman, sec. 6.2.4).
// The sign of s is free in a file: det(K R) > 0 fixes it. nullopt where the left 3x3 block is singular.
struct DecomposedProjection {
  Eigen::Matrix3d K;  // K(2,2) = 1
  Rigid3 cam_from_world;
};
std::optional<DecomposedProjection> DecomposeProjection(const Matrix34d& P);

}  // namespace lumi
