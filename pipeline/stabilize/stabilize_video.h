// lumi-pipeline VIDEO --stabilize MODEL -o OUT.mp4: the video in overlapping windows, each reconstructed, given a
// steady path that goes on from the one before, and rendered; memory and processes know one window at a time.
//
//   decode -> windows -> lumi-reconstruct -> lumi-stabilize (--continue) -> the crop of all -> lumi-render -> film,
//   with its sound
//
// What is made on the way lies in OUT-work/ beside the output, with its report; a run that was killed goes on from
// there.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/files/json_keys.h"
#include "scene/program/progress.h"
#include "scene/tradeoff/table.h"

namespace lumi {

class Executor;

struct StabilizeVideoOptions {
  std::filesystem::path input, output;  // a video; OUT.mp4
  std::string model = "smooth";
  std::vector<std::string> path_arguments;         // to lumi-stabilize, as they are
  std::vector<std::string> render_arguments;       // to lumi-render, as they are
  std::vector<std::string> reconstruct_arguments;  // to lumi-reconstruct, as they are
  std::string border = "crop";  // crop: until every picture is full; fill: the whole picture, its holes filled
  int window_frames = 0;    // most frames that are reconstructed at once, windows of one length; 0: all up to 600, else
                            // 240, or 600 for models of a whole shot's motion
  double render_scale = 1;  // of the video's size
  std::optional<double> fps;  // of the result, a constant rate; none: its frames have the input's times
  bool split_screen = false;  // OUT-split.mp4: the left half as filmed, the right half stabilised (thesis Fig. 6-7)
  bool false_color = false;   // OUT-false-color.mp4
  bool score = true;          // input and output compared (lumi-stabilize score)
  bool tradeoff = false;      // the dials against stability and seconds, on the first window
  int threads = 0;
  std::shared_ptr<Executor> executor = nullptr;  // where stages run; none: here
  unsigned long long seed = 0;
};
// Empty, or what is wrong.
std::string Validate(const StabilizeVideoOptions& options);

struct StabilizedWindow {
  int first = 0, last = 0;  // frames that it renders, inclusive
  int begin = 0, end = 0;   // frames that it was reconstructed from, inclusive
  std::string structure;    // points, homographies, none (a shot of one frame)
  std::string model;        // of its path: "smooth" for a later window that does not allow the model asked for
  double view_scale = 1, shake_before_px = 0, shake_after_px = 0, seconds = 0;
  int followed_frames = 0;
  bool cut = false;  // a cut ends it
};

struct StabilizeVideoSummary {
  std::filesystem::path video, split_screen, false_color, report;
  int frames = 0;
  int frames_reused = 0;      // that an earlier run had rendered
  double fps = 0;             // of the result; where its rate varies, one over the usual step
  bool constant_rate = true;  // else its frames have the input's times
  double kept_scale = 1;      // share of the width that is left after the crop; 1 with fill
  std::string border;
  bool sound = false;
  std::vector<StabilizedWindow> windows;
  std::optional<JsonKeys> score;          // lumi-stabilize score's; none: not asked for, or nothing could be measured
  std::optional<TradeoffTable> tradeoff;  // none: not asked for
  double peak_memory_mb = 0;              // at most: this program's and the largest one's that it started
  double seconds = 0;
};

// Throws InputError (no video stream, unreadable), DataError (one frame, times that are missing or fall), UsageError,
// MachineError, and what the programs that it starts say.
StabilizeVideoSummary RunStabilizeVideo(const StabilizeVideoOptions& options, ProgressSink& progress);

void ListKeys(JsonKeys& j, StabilizeVideoSummary& summary);
std::string Describe(const StabilizeVideoSummary& summary);

}  // namespace lumi
