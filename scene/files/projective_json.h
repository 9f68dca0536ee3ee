// SCENE/projective.json: the projection matrices and points of a scene that is not metric (scene/model/scene.h, Frame).
//
//   {"format": "lumigraph-projective", "version": 1, "frame": "quasi_affine" | "projective",
//    "plane_at_infinity": [n_x, n_y, n_z, d],                              may be missing
//    "views": [{"name": "a.jpg", "width_px": 640, "height_px": 480, "P": [12 numbers, row by row]}, ...],
//    "points": [{"X": [x, y, z, w], "color": [r, g, b], "error_px": 0.2,
//                "views": [positions in views], "x_px": [x, y of each of them]}, ...]}
//
// P has w > 0 in front, X is signed to match; pixels count from the corner of the image.
#pragma once

#include <filesystem>

#include "scene/model/scene.h"

namespace lumi {

constexpr const char* kProjectiveName = "projective.json";

// frame, views (sorted by name: name, P, size_px), points and plane_at_infinity; the rest is the manifest's. Every
// number comes back as it was written. Throws InputError naming the file and the value: a count that does not fit its
// neighbour, a number that is not finite, an index of no view, a P without rank 3, a point or plane of zeros, a
// quasi-affine point with w <= 0.
Scene ReadProjectiveJson(const std::filesystem::path& file);

// Atomically. Throws DataError for a name that is not UTF-8, std::invalid_argument for a metric scene and for what
// ReadProjectiveJson would refuse.
void WriteProjectiveJson(const Scene& scene, const std::filesystem::path& file);

}  // namespace lumi
