#include "tests/fuzz/colmap_fixture.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(colmap_text) { ReadModelWith<ColmapFormat::kText>(bytes); }

}  // namespace lumi::fuzz
