// Windows of a video or of photos, each by itself: seed, factorisation, adjustment. They are made longer until they
// have parallax.
#pragma once

#include <vector>

#include "reconstruct/factorization/reconstruct_from_tracks.h"
#include "reconstruct/factorization/seed.h"

namespace lumi {

struct SolvedWindow {
  FrameWindow window;
  Seed seed;  // seed.model: the window's, after everything
  WindowDiagnostics diagnostics;
};

struct SolvedWindows {
  std::vector<SolvedWindow> solved;          // at least one of them kPlaced
  std::vector<PairHomography> homographies;  // of the pairs without parallax; frames of `points`
  std::vector<char> keys;  // one a frame: those of windows that left frames out; empty: none is left out
};

// Windows are solved in parallel; the result is the same for any number of threads. Throws FactorizationRefused where
// no window has structure, Interrupted.
SolvedWindows SolveWindows(const ImagePoints& points, const std::optional<Camera>& camera,
                           const FactorizationOptions& options, ProgressSink& sink);

}  // namespace lumi
