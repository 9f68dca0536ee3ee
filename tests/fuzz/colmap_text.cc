#include "tests/fuzz/colmap_fixture.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(colmap_text) { ReadModelWith(bytes, ColmapFormat::kText); }

}  // namespace lumi::fuzz
