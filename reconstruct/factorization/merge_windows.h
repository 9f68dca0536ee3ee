// The windows' models in one projective frame: from the one with most frames on, whichever shares most next.
#pragma once

#include <vector>

#include "reconstruct/factorization/solve_windows.h"

namespace lumi {

struct MergedWindows {
  ProjectiveModel model;                   // of all frames
  std::vector<WindowDiagnostics> windows;  // one a window
};

// Adjusted whenever the frames have nearly doubled. Windows that share too little with the rest stay out, and say so.
MergedWindows MergeWindows(const ImagePoints& points, std::vector<SolvedWindow> solved,
                           const FactorizationOptions& options, ProgressSink& sink);

}  // namespace lumi
