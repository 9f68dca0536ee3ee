#pragma once

#include "scene/files/mesh_io.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

inline void ReadMeshAs(const char* name, std::string_view bytes) {
  const std::filesystem::path file = InputFile(name, bytes);
  const Mesh flawed = ReadMeshWithFlaws(file);
  for (const auto& face : flawed.faces)
    for (const std::int32_t v : face)
      Require(v >= 0 && static_cast<std::size_t>(v) < flawed.vertices.size(),
              "a face names a vertex that is not there");
  Require(flawed.colors.empty() || flawed.colors.size() == flawed.vertices.size(), "not a colour a vertex");
  Require(!Validate(ReadMesh(file)), "a mesh with flaws was accepted");
}

}  // namespace lumi::fuzz
