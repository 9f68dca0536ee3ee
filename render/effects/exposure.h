// The photos' exposures relative to one another, from the colours that photos of one scene point have: log c = a_point
// + log gain_photo, by robust least squares. A factor on code values: near enough to a camera's own curve for drifts of
// less than a stop. From the same colours: white balances and vignetting, which photos can be corrected for.
#pragma once

#include <array>
#include <vector>

#include "render/effects/vignetting.h"
#include "render/effects/white_balance.h"
#include "render/photos/photo_set.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

// What photos are corrected for when they are read.
struct Corrections {
  bool white_balance = false, vignetting = false;

  bool Any() const { return white_balance || vignetting; }
  bool operator==(const Corrections&) const = default;
};

struct Exposures {
  std::vector<double> gain;  // one a view, geometric mean 1; 1 where nothing is known
  double spread = 1;         // largest over smallest of the views that are known well
  double noise = 1;          // what that ratio would be by chance alone (99 %)
  bool Differ() const { return spread > 1.04 && spread > noise; }  // 4 %: ten code values in full white

  WhiteBalances white_balances;
  Vignetting vignetting;
  // As `gain`, for photos that were corrected.
  const std::vector<double>& Gain(const Corrections& c) const {
    if (!c.Any()) return gain;
    return gain_corrected[(c.white_balance ? 1U : 0U) + (c.vignetting ? 2U : 0U) - 1U];
  }
  std::array<std::vector<double>, 3> gain_corrected;  // for white balance, vignetting, both
};

Exposures EstimateExposures(const Scene& scene, const std::vector<Photo>& photos);
// The same for photos that are not in memory: each is read once, at most one per thread at a time.
Exposures EstimateExposures(const Scene& scene, ProgressSink& progress);

// Prepares the views for photos with these corrections: sets the corrections that LoadPhoto applies, and the gains that
// restore the brightness they take away.
void Apply(const Exposures& exposures, const Corrections& corrections, Scene& scene);

}  // namespace lumi
