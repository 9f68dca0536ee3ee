// What accuracy costs: the scene is made as always, then once more under each of a table of settings, into temporary
// folders; time and error of each, beside each other.
//
//   options.tradeoff = true;
//   const MeasuredReconstruction measured = ReconstructWithTradeoff(options, sink);
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reconstruct/options.h"
#include "scene/geometry/similarity3.h"
#include "scene/program/progress.h"
#include "scene/tradeoff/table.h"

namespace lumi {

// One row of the table before it is measured.
struct ReconstructSetting {
  std::string name;  // what differs from the options as given: "features 400"; these: "as given"
  // The dial that was turned: "features", "window", "adjustment", "image size", "pairs", "mapper", "features by",
  // "several"; "" as given.
  std::string line;
  ReconstructOptions options;  // with every dial's value, none left to its default
  double effort = 1;           // 1 as given; times a dial's factor: the dearest setting is the one expected to be best
};

// What the table depends on beside the options.
struct ReconstructExtent {
  int photos = 0;  // or keyframes of a video
  bool is_video = false;
  int longest_side_px = 0;  // of the photos
};

// The options as given first, then lines through them, one dial at a time, then the cheapest and the dearest of all
// dials together. Values that would do the same as another row's (a window beyond the last frame, a size beyond the
// photos') are left out.
std::vector<ReconstructSetting> TradeoffSettings(const ReconstructOptions& options, const ReconstructExtent& extent);

struct TradeoffRow {
  ReconstructSetting setting;
  std::string failed;  // why there is no scene; empty: there is one
  double seconds = 0;  // the whole run, photos to scene
  int images_registered = 0, images_total = 0, points = 0;
  double mean_reprojection_error_px = 0;
  std::string upgrade;
  std::optional<PoseErrors> poses;  // against the reference, after alignment; none: not metric, or the reference itself
  bool is_reference = false;
  bool on_front = false;  // no other row that placed as many photos is both faster and better
};

struct ReconstructTradeoff {
  Backend backend = Backend::kColmap;
  std::string reference;  // what `poses` are against, for people; empty: no row is metric
  std::vector<TradeoffRow> rows;
  TradeoffFiles files;  // SCENE/tradeoff/BACKEND.*
  double seconds = 0;
};

struct MeasuredReconstruction {
  ReconstructSummary summary;  // of the scene in options.scene
  ReconstructTradeoff tradeoff;
};

// The reference is options.reference; without it truth/ beside the folder of photos, as lumi-simulate leaves it;
// without that the dearest setting's own cameras. A setting that fails is a row with its reason. Throws what
// Reconstruct throws for the options as they are, UsageError and InputError for a reference that is no scene, DataError
// where it does not know three of the photos; all but the last before anything is computed. Interrupted leaves the
// scene and no table.
MeasuredReconstruction ReconstructWithTradeoff(const ReconstructOptions& options, ProgressSink& sink);

// The rows that no other is both faster and better than: `on_front` is set. By the centres where rows have poses, else
// by the reprojection error; only rows that placed as many photos as any did.
void MarkFront(std::vector<TradeoffRow>& rows);

std::string TradeoffCsv(const ReconstructTradeoff& tradeoff);
std::string TradeoffSvg(const ReconstructTradeoff& tradeoff);
// The summary's keys and "tradeoff".
void ListKeys(JsonKeys& j, MeasuredReconstruction& measured);
std::string Describe(const MeasuredReconstruction& measured);
// The table for people.
std::string Describe(const ReconstructTradeoff& tradeoff);

}  // namespace lumi
