// Which silhouettes agree with each other, and how far they have to be dilated for it.
//
// A pixel of a silhouette is covered by the hull if some point on its ray lies inside every other silhouette: it needs
// a dilation of min over the ray of max over the views of the signed distance. Where that is too much, the views that
// stand in the way where they cost least are to blame; where they are many, the pixel's own view is: its camera is off
// or its silhouette too large. The view with most blame is left out, until the others agree.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "proxy/hull/agreement_ray.h"
#include "proxy/hull/silhouette_cone.h"
#include "scene/program/progress.h"

namespace lumi {

struct AgreementOptions {
  double max_dilation_px = 2;           // silhouettes that need more do not agree
  double max_uncovered = 0.005;         // of a silhouette's pixels
  double max_uncovered_depth_px = 2;    // from the silhouette's border; infinite: only the share counts
  std::size_t fewest_used = 2;          // fewer than these are no answer: the search for them ends there
  std::function<void()> go_on = [] {};  // asked between rounds; throws where there is no time left
};

struct Disagreement {
  std::size_t view;      // position among the views
  double blame = 0;      // silhouettes' worth of pixels that it cuts off from others, or that nobody covers of its own
  double uncovered = 0;  // share of its own silhouette that needs more dilation than allowed
};

struct Agreement {
  std::vector<std::size_t> used;       // positions among the views, ascending
  std::vector<Disagreement> left_out;  // in the order in which they were found
  double uncovered = 0;                // share of the used silhouette that agrees least: small unless only two are left
};

// rays: of each view through its silhouette. At least two views are used, even where those do not agree; the search
// ends with fewer than options.fewest_used.
Agreement FindAgreement(const std::vector<std::vector<AgreementRay>>& rays, const std::vector<SilhouetteCone>& cones,
                        const AgreementOptions& options, ProgressSink& progress);

// The dilation, at most options.max_dilation_px, at which each of the used views is covered as far as the options ask.
struct NeededDilation {
  double px = 0;
  bool enough = true;  // false: not even the largest covers them
};
NeededDilation FindDilation(const std::vector<std::vector<AgreementRay>>& rays,
                            const std::vector<SilhouetteCone>& cones, const std::vector<std::size_t>& used,
                            const AgreementOptions& options, ProgressSink& progress);

}  // namespace lumi
