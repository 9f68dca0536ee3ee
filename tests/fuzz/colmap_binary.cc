#include "tests/fuzz/colmap_fixture.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(colmap_binary) { ReadModelWith<ColmapFormat::kBinary>(bytes); }

}  // namespace lumi::fuzz
