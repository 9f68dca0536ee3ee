// Silhouettes that lack a part: a shadow on the object, a highlight, a limb before a background of its colour. One such
// notch cuts the part off for all views. Where views show something that few others carve away, the few are taken to
// lack it, and their silhouettes are mended there: the hull grows by what somebody sees, and all views stay in use.
// Views that would have to be mended too much, or that show what many others carve away, are left out.
#pragma once

#include <cstddef>
#include <vector>

#include "proxy/hull/agreement_ray.h"
#include "proxy/hull/consistency.h"
#include "proxy/hull/coverage.h"
#include "proxy/hull/silhouette_cone.h"
#include "scene/program/progress.h"

namespace lumi {

struct MendOptions {
  AgreementOptions agreement;
  double max_mended = 0.05;  // of a silhouette's pixels, added; 0: none is mended
  double max_excess = 0.01;  // of a silhouette's pixels, shown by it alone: others are not mended for more
  bool leave_out = true;     // views that cannot be brought to agree; false: they stay
};

// What is added to one silhouette: discs around pixels, on behalf of another view.
struct Mend {
  double u, v, radius_px;
  std::size_t by;
};
// The silhouette with its mends and what lies between them; a hole that has to be mended in places is filled.
Image8 Mended(const Image8& mask, const std::vector<Mend>& mends);

// The silhouettes of one object on their way to a hull: which of them are used, and their cones with what was mended.
struct Carving {
  std::vector<SilhouetteView> views;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // of the cones' frame, and the length of its unit, in world
  double unit = 1;
  std::vector<SilhouetteCone> cones = {};
  std::vector<std::vector<Mend>> mends = {};  // of each view
  Agreement agreement = {};
};

// Looks at the pixels that a hull of the used views leaves uncovered (uncovered[n] of agreement.used[n]), mends
// silhouettes (the cones of those are made again) and leaves views out of the agreement, until no pixel that the
// options do not spare disagrees by more than options.agreement.max_dilation_px, nothing can be done, or fewer than
// options.agreement.fewest_used are left. True: something was changed.
bool SettleConflicts(const std::vector<std::vector<UncoveredPixel>>& uncovered, const RayCaster& rays,
                     const MendOptions& options, Carving& carving, ProgressSink& progress);

}  // namespace lumi
