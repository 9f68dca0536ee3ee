#include <cmath>

#include "proxy/silhouettes/colour_rule.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(colour_rule) {
  const ColourRule rule{std::string(bytes)};
  Image8 photo(3, 2, 3);
  for (std::size_t i = 0; i < photo.data.size(); ++i) photo.data[i] = static_cast<std::uint8_t>(i * 50);
  for (const std::uint8_t v : SilhouetteFromRule(photo, rule).data)
    Require(v == 0 || v == 255, "a silhouette that is neither black nor white");
}

}  // namespace lumi::fuzz
