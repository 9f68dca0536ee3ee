// Which photos are worth matching, where there are too many to match each with all others: those that look alike, those
// that GPS puts near one another, and then what the matches that were found make likely. Photos by index.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "reconstruct/photos.h"
#include "scene/program/progress.h"

namespace lumi {

using PhotoPairs = std::vector<std::pair<int, int>>;  // first < second, sorted, each once

// Sorted, each once, none with itself.
PhotoPairs Joined(PhotoPairs a, const PhotoPairs& b);

// What is known before anything is matched.
struct PairHints {
  PhotoPairs near;      // worth matching
  bool is_all = false;  // nothing else is: where the cameras are known
};

// A pair whose geometry holds.
struct VerifiedPair {
  int a = 0, b = 0;
  int matches = 0;
};

class ViewGraph {
 public:
  // Of photos whose features are in COLMAP's database; a photo that is not has no partner.
  ViewGraph(const std::vector<std::string>& names, const std::filesystem::path& database, std::uint64_t seed,
            ProgressSink& sink);
  explicit ViewGraph(Eigen::MatrixXf vectors);  // scene/tracks/vlad.h

  // Each photo with the `most` that look most like it. O(photos^2).
  PhotoPairs Similar(int most, ProgressSink& sink = SilentProgress()) const;

  // What to try next: photos that have most of their partners in common; and, for parts of the graph that no pairs or
  // only pairs of few matches connect, the photos elsewhere that look most like theirs. None of `tried`; empty: nothing
  // is left. O(pairs * partners), and for each photo of such a part one product with all vectors.
  PhotoPairs Next(const PhotoPairs& tried, const std::vector<VerifiedPair>& verified,
                  ProgressSink& sink = SilentProgress()) const;

 private:
  PhotoPairs AcrossParts(const PhotoPairs& tried, const std::vector<VerifiedPair>& verified, ProgressSink& sink) const;

  Eigen::MatrixXf vectors_;
};

// Each photo with the 12 nearest by EXIF's GPS; empty where fewer than half of the photos have it. O(n^2).
PhotoPairs NearByGps(const std::vector<InputPhoto>& photos);

}  // namespace lumi
