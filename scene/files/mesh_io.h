// PLY (ASCII, binary of both byte orders, float or double, polygons fanned) and OBJ.
#pragma once

#include <filesystem>

#include "scene/geometry/mesh.h"

namespace lumi {

// Throws InputError: unreadable, counts beyond the file's size, NaN, indices out of range. Never allocates by a count
// it has not checked. Throws MachineError, before it reads, where file and mesh would not fit into the free memory.
// `work_bytes_per_face`: further memory that the caller's work on the mesh takes.
Mesh ReadMesh(const std::filesystem::path& path, std::size_t work_bytes_per_face = 0);
// The same, with vertices that are not finite.
Mesh ReadMeshWithFlaws(const std::filesystem::path& path, std::size_t work_bytes_per_face = 0);
// PLY (binary little endian, double) or OBJ by extension; atomic.
void WriteMesh(const std::filesystem::path& path, const Mesh& mesh);

}  // namespace lumi
