// Stereo's own planes, which it goes on from.
#include "proxy/dense/depth_files.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(planes_map) {
  const DepthMap map = ReadPlanes(InputFile("photo.planes", bytes));
  Require(map.width > 0 && map.height > 0 && map.w.size() == map.Pixels() && map.cost.size() == map.Pixels(),
          "a map of another size than it says");
}

}  // namespace lumi::fuzz
