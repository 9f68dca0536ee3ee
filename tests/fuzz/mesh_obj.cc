#include "tests/fuzz/mesh_fixture.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(mesh_obj) { ReadMeshAs("mesh.obj", bytes); }

}  // namespace lumi::fuzz
