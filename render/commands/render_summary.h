// What lumi-render did: of a path, one view, or the held-out photos.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/effects/effects.h"
#include "render/holdout/holdout.h"
#include "render/tradeoff/budget.h"
#include "render/tradeoff/fidelity.h"

namespace lumi {

struct PathFigures {
  long reused = 0;  // frames that were there already
  Eigen::Vector2i size_px = {0, 0};
  double ms_slowest = 0;  // of the frames rendered
  bool widened = false;   // --border fill, proxies of each view's own: what photos saw, shares of the pixels
  std::optional<double> coverage_window, coverage_wider;
  std::string video;  // empty: none
};

// Where not all photos were held.
struct PhotosInMemory {
  long read = 0;        // how often one was, from its file
  int most_halved = 0;  // how often a picture's photos were halved to fit, at most
  double most_mb = 0;   // of photos, at once
  double seconds = 0;   // of reading them, in the pictures' milliseconds, too
};

struct ViewFigures {
  std::string name;
  bool left_out = false;  // the photo itself was not used
  double coverage = 0;
  std::optional<double> time_s;
  // Of pictures, not of heat maps and false colours.
  std::optional<double> psnr_db, ssim, mean_absolute_difference, mean_absolute_difference_seen;
};

struct HoldoutFigures {
  int n = 0;                    // or kHoldoutEach,
  std::string fold;             // which has none
  std::string proxy_evaluated;  // that the photos were rendered over: made without them where the scene has such a one
  std::string seen_proxy;       // --seen-proxy; empty: the same
  HoldoutSummary errors;
};

// Of a heat map's colours.
struct MeasureScale {
  std::string measure;
  double low = 0, high = 0;
  std::string unit;
};

// What --budget-ms came to.
struct KeptBudget {
  BudgetChoice choice;
  std::optional<double> ms;  // a frame, measured; nullopt: none was rendered
  bool met = false;          // by what was measured, else by what is expected
  std::string meets_it;      // what would, where it is not met; empty: it is
};

struct RenderSummary {
  long frames = 0;
  std::optional<double> ms_per_frame, coverage;  // nullopt: all frames were there already
  std::optional<PathFigures> path;               // one of the three
  std::vector<ViewFigures> views;                // the one of --view
  std::optional<HoldoutFigures> holdout;
  std::string proxy;
  std::string frame;       // of a scene without a metric
  int window_frames = -1;  // photos to either side in time; -1: all
  std::string device;
  RadianceSettings settings;
  bool own_times = true;  // each frame of its own moment: time-s would stop them all
  std::string backend;
  std::optional<KeptBudget> budget;
  std::optional<FidelityChoice> fidelity;
  std::optional<MeasureScale> scale;
  std::vector<Effect> effects;
  std::optional<MeasuredCorrelation> correlation;  // of --correlation measured
  std::optional<PhotosInMemory> photos_in_memory;  // none: all were
  long samples = 0;                                // of all frames rendered: rays at which weights were computed ...
  OptimumCounts optimum;                           // ... and what the optimum says of them
};

void ListKeys(JsonKeys& j, RenderSummary& summary);
std::string Describe(const RenderSummary& summary);    // a few lines for people
std::string ResultLine(const RenderSummary& summary);  // what is printed under --quiet, too; empty: no figures

}  // namespace lumi
