#include <cmath>

#include "reconstruct/view_times.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(view_times) {
  const ViewTimes times = ReadViewTimes(InputFile("times.csv", bytes));
  Require(!times.photos.empty(), "no photo was accepted");
  for (const ListedTime& t : times.photos)
    Require(!t.name.empty() && std::isfinite(t.time), "a photo without a name or time");
}

}  // namespace lumi::fuzz
