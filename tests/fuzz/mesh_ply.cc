#include "tests/fuzz/mesh_fixture.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(mesh_ply) { ReadMeshAs("mesh.ply", bytes); }

}  // namespace lumi::fuzz
