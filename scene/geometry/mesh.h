// A triangle mesh: the form every proxy takes.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace lumi {

struct Mesh {
  std::vector<Eigen::Vector3d> vertices;            // in world units
  std::vector<std::array<std::int32_t, 3>> faces;   // counter-clockwise seen from outside
  std::vector<std::array<std::uint8_t, 3>> colors;  // RGB a vertex, or empty

  Eigen::Vector3d FaceNormal(std::size_t face) const;  // unit; zero for a face without area
};

// What is wrong with a mesh as geometry to be rendered (NaN or infinite vertices, indices out of range), or nullopt.
// One line, names the first offending vertex or face.
std::optional<std::string> Validate(const Mesh& mesh);

// Every edge is shared by exactly two faces, in opposite directions.
bool IsClosed(const Mesh& mesh);

// Appends `other` (colours are kept only if both have them).
void Append(Mesh& mesh, const Mesh& other);

}  // namespace lumi
