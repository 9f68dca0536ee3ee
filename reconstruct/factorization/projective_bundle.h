// Robust projective bundle adjustment (Triggs et al. 2000): twelve numbers a camera and four a point, each on a sphere,
// so that their free scales are gone. The projective frame stays free; damping holds it.
#pragma once

#include <vector>

#include "reconstruct/factorization/projective_model.h"

namespace lumi {

struct BundleOptions {
  enum class Loss { kNone, kHuber, kCauchy };
  Loss loss = Loss::kCauchy;
  double scale_px = 1.0;  // of the loss
  int max_iterations = 30;
  double tolerance = 1e-6;  // stops where the cost falls by less than this part in a step
  // Frames: a track that lasts longer counts as several points, one after the other, so that a camera depends on its
  // neighbours only and the cost of a step grows linearly with the frames. Long tracks then no longer tie the ends of a
  // long video together, so this is for intermediate adjustments, not for the last. 0: no limit.
  int max_span = 0;
  std::vector<char> whole;  // one a track: those that are not cut all the same; empty: none
};

// How a track is cut.
struct TrackPieces {
  int first = 0, frames = 1, count = 1;
  int Of(int frame) const {
    return count == 1 ? 0 : static_cast<int>(static_cast<long>(frame - first) * count / frames);
  }
};
TrackPieces CutTrack(const ImagePoints& points, const ProjectiveModel& used, std::size_t track,
                     const BundleOptions& options);

// The sights of a track that are in use, and where another piece of it begins, before its first one: begin(is_middle),
// sight(sight). The middle piece's point is the track's.
template <typename Begin, typename Each>
void EachPiece(const ImagePoints& points, const ProjectiveModel& used, std::size_t track, const BundleOptions& options,
               const Begin& begin, const Each& each) {
  const TrackPieces pieces = CutTrack(points, used, track, options);
  int piece = -1;
  for (std::size_t k = 0; k < points.tracks[track].size(); ++k) {
    const Sight& sight = points.tracks[track][k];
    if (!used.inlier[track][k] || !used.placed[static_cast<std::size_t>(sight.frame)]) continue;
    if (const int now = pieces.Of(sight.frame); now != piece) {
      piece = now;
      begin(now == pieces.count / 2);
    }
    each(sight);
  }
}

struct BundleSummary {
  bool usable = false;  // false: nothing was changed
  bool converged = false;
  int iterations = 0;
  double start_rms_px = 0, rms_px = 0;  // over the inliers
  double seconds = 0;
};

// Over the inlier sights of placed frames and solved tracks. held (empty, or one a frame): cameras that do not move.
BundleSummary AdjustProjective(const ImagePoints& points, ProjectiveModel& model, const BundleOptions& options,
                               const std::vector<char>& held = {});

}  // namespace lumi
