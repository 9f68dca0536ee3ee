// What lumi-render did: of a path, one view, or the held-out photos.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/effects/effects.h"
#include "render/holdout/holdout.h"
#include "render/show/legend.h"
#include "render/tradeoff/budget.h"
#include "render/tradeoff/fidelity.h"

namespace lumi {

struct PathFigures {
  long reused = 0;  // frames that were there already
  Eigen::Vector2i size_px = {0, 0};
  double ms_first = 0;    // of the frames rendered: maps of what photos see are made, and photos read
  double ms_slowest = 0;  // of those after it
  bool widened = false;   // --border fill with a proxy for each view: the two coverages, shares of the pixels, are set
  std::optional<double> coverage_window, coverage_wider;
  std::string video;  // empty: none
};

// Set if not all photos were held in memory.
struct PhotosInMemory {
  long read = 0;        // photos read from their files, repeats included
  int most_halved = 0;  // the most often that a picture's photos were halved to fit
  double most_mb = 0;   // of photos held at once, at most
  double seconds = 0;   // spent reading them; the pictures' milliseconds include it
};

// What a pixel is blended from.
struct PixelPhoto {
  std::string photo, color;  // of false colours, "#rrggbb"
  double weight = 0;
};
struct AskedPixel {
  Eigen::Vector2d x_px = {0, 0};
  double alpha = 0;                // 0: a hole
  std::vector<double> point;       // of the proxy, world units; empty: the ray misses it, or it has no world of its own
  std::vector<PixelPhoto> photos;  // the largest weight first
};

struct ViewFigures {
  std::string name;
  bool left_out = false;  // the photo itself was not used
  double coverage = 0;
  std::optional<double> time_s;
  std::vector<LegendEntry> legend;  // of false colours
  std::vector<AskedPixel> pixels;   // --pixel
  // Of pictures, not of heat maps and false colours.
  std::optional<double> psnr_db, ssim, mean_absolute_difference, mean_absolute_difference_seen;
};

struct HoldoutFigures {
  int n = 0;                    // or kHoldoutEach
  std::string fold;             // empty for kHoldoutEach
  std::string proxy_evaluated;  // rendered over; if the scene has one, a proxy made without the held-out photos
  std::string seen_proxy;       // --seen-proxy; empty: the same
  HoldoutSummary errors;
};

// Of a heat map's colours.
struct MeasureScale {
  std::string measure;
  double low = 0, high = 0;
  std::string unit;
};

// The result of --budget-ms.
struct KeptBudget {
  BudgetChoice choice;
  std::optional<double> ms;  // a frame, measured; nullopt: none was rendered
  bool met = false;          // judged by the measured time, else by the expected one
  std::string meets_it;      // options that would meet the budget; empty: it is met
};

struct RenderSummary {
  long frames = 0;
  std::filesystem::path wrote;                   // the picture, the film, or the folder of the frames; empty: nothing
  std::optional<double> ms_per_frame, coverage;  // nullopt: all frames were there already
  std::optional<PathFigures> path;               // one of the three
  std::vector<ViewFigures> views;                // the one of --view
  std::optional<HoldoutFigures> holdout;
  std::string proxy;
  std::string frame;       // named for a scene without a metric only
  int window_frames = -1;  // photos to either side in time; -1: all
  std::string device;
  RadianceSettings settings;
  bool own_times = true;  // each frame shows its own moment: settings are printed without time-s
  std::string backend;
  std::optional<KeptBudget> budget;
  std::optional<FidelityChoice> fidelity;
  std::optional<MeasureScale> scale;
  std::vector<Effect> effects;
  std::optional<MeasuredCorrelation> correlation;  // of --correlation measured
  std::optional<PhotosInMemory> photos_in_memory;  // none: all photos were held
  long samples = 0;                                // rays at which weights were computed, over all frames
  OptimumCounts optimum;                           // what the optimum counted at these rays
};

void ListKeys(JsonKeys& j, RenderSummary& summary);
std::string Describe(const RenderSummary& summary);    // a few lines for people
std::string ResultLine(const RenderSummary& summary);  // what is printed under --quiet, too; empty: no figures

}  // namespace lumi
