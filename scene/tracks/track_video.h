// Corners followed through a video: Shi-Tomasi corners, pyramidal Lucas-Kanade checked forward and backward, and each
// track held to the patch that it began with (affine_patch.h), so that it neither drifts nor jumps to a neighbour.
//
//   Tracks tracks = TrackVideo(PhotoSource(folder, names, masks), {}, progress);
//
// Same frames and options, same tracks, whatever the number of threads.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/program/progress.h"
#include "scene/tracks/frame_source.h"
#include "scene/tracks/tracks.h"

namespace lumi {

struct TrackVideoOptions {
  int features = 800;                // tracks aimed at in a frame; new corners fill up to it. 8 and more
  int min_length = 5;                // frames; shorter tracks are dropped. 2 and more
  int window_px = 21;                // Lucas-Kanade's window, odd, 5 to 101
  int levels = 4;                    // halvings above the frame: movements up to about window / 2 x 2^levels. 0 to 10
  double forward_backward_px = 0.5;  // a corner followed there and back again ends within this
  int patch_px = 21;                 // side of the patch that a track is held to, odd, 7 to 61
  double min_correlation =
      0.8;  // with the first patch (normalised; from 1 downwards); below it the track ends. 0 = any
  // Positions come from the alignment with the first patch. Off: from Lucas-Kanade's single steps, which drift; the
  // patch is then compared only.
  bool hold_to_first_patch = true;
  // Fewer corners followed than this share of those alive: a cut, where all tracks end. 0 to 1
  double cut_share = 0.15;
};
// What is wrong with the options, or nullopt.
std::optional<std::string> Validate(const TrackVideoOptions& options);

struct TrackVideoSummary {
  std::vector<int> alive;     // tracks (of those returned) seen in each frame
  std::vector<int> cuts;      // frames that begin a new shot
  std::vector<int> repeated;  // frames equal to the one before, pixel by pixel
  int blank_frames = 0;       // without a corner
  int dropped_short = 0;
  // Why tracks ended before the last frame.
  int ended_lost = 0;     // not found, or not the same there and back, or outside the frame
  int ended_changed = 0;  // the patch no longer looks as it did
  int ended_masked = 0;
  int ended_crowded = 0;  // two tracks met: the younger one ended
  double seconds = 0;
};

// Observations are in the frames of `source`, one track at most passes within a few pixels of another. Blank frames are
// no failure: fewer or no tracks, and a message. Throws UsageError (options), DataError naming the file (a frame of
// another size than the first), Interrupted, and what the source throws.
Tracks TrackVideo(const FrameSource& source, const TrackVideoOptions& options, ProgressSink& progress,
                  TrackVideoSummary* summary = nullptr);

}  // namespace lumi
