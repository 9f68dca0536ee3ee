// What a photo shows, as one vector: by what its descriptors differ from the nearest of a few words, summed word by
// word (VLAD: Jegou, Douze, Schmid, Perez 2010; each word's sum of unit length: Arandjelovic and Zisserman 2013). Words
// are means of the photos' own descriptors: nothing is downloaded, and what all photos show (leaves, a brick) weighs
// little.
//
// Photos that show the same have vectors with a large product.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "scene/program/progress.h"
#include "scene/tracks/match_bytes.h"

namespace lumi {

struct VladOptions {
  int words = 64;
  int sample = 60000;  // descriptors that words are made from, of all photos alike
  int most = 1024;     // descriptors of a photo that count, the first ones
  std::uint64_t seed = 0;
};

// Shape (words * 128, photos): a photo's column has length 1, or 0 where it has no feature. descriptors(i) of photo i
// is called twice, by one thread at a time. Same descriptors and options, same vectors, whatever the number of threads.
Eigen::MatrixXf DescribePhotos(std::size_t photos, const std::function<ByteDescriptors(std::size_t)>& descriptors,
                               const VladOptions& options);

struct SimilarPhotos {
  std::optional<std::vector<int>> of;             // of these photos; nothing: of all
  std::function<bool(int photo, int other)> may;  // which others count; empty: all. Called by several threads
  Progress* progress = nullptr;                   // a step for each photo of `of`
};
// For each photo of `of` so many others with the largest products, the largest first; none for and of a column of
// zeros.
std::vector<std::vector<int>> MostSimilar(const Eigen::MatrixXf& photos, int most, const SimilarPhotos& choice = {});

}  // namespace lumi
