// Tracks across unordered photographs: SIFT features, matched both ways with a ratio test, each pair of photos verified
// by its epipolar geometry, matches joined to tracks. Every pair is tried, or of many photos (`partners`) those that a
// few features of each say are worth it.
//
// Same photos, options and seed, same tracks, whatever the number of threads.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "scene/program/progress.h"
#include "scene/tracks/frame_source.h"
#include "scene/tracks/tracks.h"

namespace lumi {

struct MatchPhotosOptions {
  int max_features = 2048;  // a photo, strongest first; time grows with its square. 8 and more
  int max_size_px = 1600;   // features are sought in photos scaled down to this longer side. 16 and more
  double ratio = 0.8;       // distance to the best match over distance to the second best, at most. Above 0, up to 1
  double epipolar_px = 2;   // distance to the epipolar line, pixels of the scaled photo
  int min_matches = 16;     // verified matches that a pair needs. 8 and more
  int min_length = 2;       // photos; shorter tracks are dropped. 2 and more
  std::uint64_t seed = 0;
  // Pairs (first < second) to try; empty: all, or by `partners`.
  std::vector<std::pair<int, int>> pairs;
  // Above 0, and `pairs` empty: a pair is tried where one of its photos is among so many that the other's strongest
  // features match best (preemptive matching, Wu 2013). Finding these costs about a fiftieth of trying all pairs.
  int partners = 0;
};
std::optional<std::string> Validate(const MatchPhotosOptions& options);

struct MatchedPair {
  int first = -1, second = -1;  // photos
  int matches = 0;              // by descriptor, mutual
  int verified = 0;             // of these, by geometry; 0: the pair was refused
};

struct MatchPhotosSummary {
  std::vector<int> features;       // found in each photo
  std::vector<MatchedPair> pairs;  // tried in full, in order of first, second
  int conflicts = 0;               // matches not followed: they would have joined two points of one photo
  double seconds = 0;
};

// Photos may differ in size. A photo without features takes part in no track, and a message names it. Throws UsageError
// (options, a pair that names no photo), DataError naming the file, Interrupted, and what the source throws.
Tracks MatchPhotos(const FrameSource& source, const MatchPhotosOptions& options, ProgressSink& progress,
                   MatchPhotosSummary* summary = nullptr);

}  // namespace lumi
