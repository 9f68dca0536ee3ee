#include "tests/fuzz/colmap_fixture.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(colmap_binary) { ReadModelWith(bytes, ColmapFormat::kBinary); }

}  // namespace lumi::fuzz
