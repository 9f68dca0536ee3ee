#include "reconstruct/thin_matches.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <tuple>

#include "reconstruct/colmap_database.h"
#include "scene/geometry/disjoint_sets.h"

namespace lumi {
namespace {

constexpr double kWorthwhile = 2.0 / 3;

// Lists of indices, one after another: list i is [first[i], first[i + 1]) of `items`.
struct Lists {
  std::vector<std::size_t> first;
  std::vector<std::uint32_t> items;
  std::size_t Size(std::size_t i) const { return first[i + 1] - first[i]; }
  auto Of(std::size_t i) const {
    return std::pair(items.begin() + static_cast<std::ptrdiff_t>(first[i]),
                     items.begin() + static_cast<std::ptrdiff_t>(first[i + 1]));
  }
};

// Item k goes to list list_of(k), k = 0, 1 ... count - 1.
template <typename ListOf>
Lists Collect(std::size_t lists, std::size_t count, const ListOf& list_of) {
  Lists made{std::vector<std::size_t>(lists + 1, 0), std::vector<std::uint32_t>(count)};
  for (std::size_t k = 0; k < count; ++k) ++made.first[list_of(k) + 1];
  std::partial_sum(made.first.begin(), made.first.end(), made.first.begin());
  std::vector<std::size_t> next(made.first.begin(), made.first.end() - 1);
  for (std::size_t k = 0; k < count; ++k) made.items[next[list_of(k)]++] = static_cast<std::uint32_t>(k);
  return made;
}

// The cell of each feature among those of all photos; features of photo i begin at first_feature[i].
std::vector<std::uint32_t> CellsOf(const std::vector<std::vector<Eigen::Vector2d>>& keypoints_px, int cells) {
  std::vector<std::uint32_t> cell_of;
  for (std::size_t photo = 0; photo < keypoints_px.size(); ++photo) {
    Eigen::Array2d low = Eigen::Array2d::Constant(1e300), high = -low;
    for (const Eigen::Vector2d& x : keypoints_px[photo]) {
      low = low.min(x.array());
      high = high.max(x.array());
    }
    for (const Eigen::Vector2d& x : keypoints_px[photo]) {
      const Eigen::Array2d share = (x.array() - low) / (high - low).max(1e-9);
      const Eigen::Array2i at = (share * cells).cast<int>().min(cells - 1);
      cell_of.push_back(static_cast<std::uint32_t>((static_cast<int>(photo) * cells + at.y()) * cells + at.x()));
    }
  }
  return cell_of;
}

}  // namespace

std::vector<PairMatches> ThinMatches(const std::vector<PairMatches>& pairs,
                                     const std::vector<std::vector<Eigen::Vector2d>>& keypoints_px,
                                     const ThinningOptions& options) {
  std::vector<std::size_t> first_feature(keypoints_px.size() + 1, 0);
  for (std::size_t i = 0; i < keypoints_px.size(); ++i)
    first_feature[i + 1] = first_feature[i] + keypoints_px[i].size();
  const std::size_t features = first_feature.back();
  const auto feature = [&](std::int32_t photo, int i) {
    return first_feature[static_cast<std::size_t>(photo)] + static_cast<std::size_t>(i);
  };

  // Tracks, called by their first feature, and what belongs to each.
  DisjointSets joined(features);
  std::vector<std::uint32_t> pair_of;  // of each match
  std::vector<std::size_t> end_of;     // one feature of each match
  for (std::size_t p = 0; p < pairs.size(); ++p)
    for (const auto& [i, j] : pairs[p].matches) {
      joined.Join(feature(pairs[p].photo1, i), feature(pairs[p].photo2, j));
      pair_of.push_back(static_cast<std::uint32_t>(p));
      end_of.push_back(feature(pairs[p].photo1, i));
    }
  const Lists features_of = Collect(features, features, [&](std::size_t f) { return joined.Find(f); });
  const Lists matches_of = Collect(features, pair_of.size(), [&](std::size_t m) { return joined.Find(end_of[m]); });

  std::vector<std::uint32_t> photo_of(features);
  for (std::size_t i = 0; i < keypoints_px.size(); ++i)
    std::fill(photo_of.begin() + static_cast<std::ptrdiff_t>(first_feature[i]),
              photo_of.begin() + static_cast<std::ptrdiff_t>(first_feature[i + 1]), static_cast<std::uint32_t>(i));
  // The longest first; those that contradict themselves last. Of equals in a random order: in that of their features
  // each photo's would be taken before the next photo's, which then lacks some, again and again.
  std::vector<std::tuple<bool, std::ptrdiff_t, std::uint32_t, std::size_t>> order;
  std::mt19937 random;
  for (std::size_t track = 0; track < features; ++track) {
    if (features_of.Size(track) < 2) continue;
    const auto [begin, end] = features_of.Of(track);  // ascending, so photo by photo
    const bool twice =
        std::adjacent_find(begin, end, [&](auto a, auto b) { return photo_of[a] == photo_of[b]; }) != end;
    order.emplace_back(twice, -static_cast<std::ptrdiff_t>(features_of.Size(track)), random(), track);
  }
  std::ranges::sort(order);

  const std::vector<std::uint32_t> cell_of = CellsOf(keypoints_px, options.cells);
  std::vector<int> in_cell(keypoints_px.size() * static_cast<std::size_t>(options.cells * options.cells), 0);
  std::vector<int> in_pair(pairs.size(), 0);
  std::vector<bool> kept(features, false);
  for (const auto& [twice, length, chance, track] : order) {
    const auto [f, f_end] = features_of.Of(track);
    const auto [m, m_end] = matches_of.Of(track);
    const bool wanted = std::any_of(f, f_end, [&](auto k) { return in_cell[cell_of[k]] < options.of_a_cell; }) ||
                        std::any_of(m, m_end, [&](auto k) { return in_pair[pair_of[k]] < options.of_a_pair; });
    if (!wanted) continue;
    kept[track] = true;
    std::for_each(f, f_end, [&](auto k) { ++in_cell[cell_of[k]]; });
    std::for_each(m, m_end, [&](auto k) { ++in_pair[pair_of[k]]; });
  }

  std::vector<PairMatches> thinned;
  for (const PairMatches& pair : pairs) {
    PairMatches left{pair.photo1, pair.photo2, {}};
    std::ranges::copy_if(pair.matches, std::back_inserter(left.matches),
                         [&](const auto& match) { return kept[joined.Find(feature(pair.photo1, match.first))]; });
    thinned.push_back(std::move(left));
  }
  return thinned;
}

bool WriteThinnedDatabase(const std::filesystem::path& database, const std::filesystem::path& thinned) {
  const ColmapDatabase whole(database);
  std::map<std::int64_t, std::int32_t> photo_of;
  std::vector<std::int64_t> image_of;
  std::vector<std::vector<Eigen::Vector2d>> keypoints_px;
  for (const DatabaseImage& image : whole.Images()) {
    photo_of[image.id] = static_cast<std::int32_t>(image_of.size());
    image_of.push_back(image.id);
    keypoints_px.push_back(whole.Keypoints(image.id));
  }
  std::vector<PairMatches> pairs;
  std::size_t all = 0, left = 0;
  for (const DatabasePair& pair : whole.VerifiedPairs()) {
    const auto a = photo_of.find(pair.image1), b = photo_of.find(pair.image2);
    if (a == photo_of.end() || b == photo_of.end()) continue;
    PairMatches read{a->second, b->second, whole.VerifiedMatches(pair.image1, pair.image2)};
    std::erase_if(read.matches, [&](const auto& match) {
      return match.first < 0 ||
             static_cast<std::size_t>(match.first) >= keypoints_px[static_cast<std::size_t>(a->second)].size() ||
             match.second < 0 ||
             static_cast<std::size_t>(match.second) >= keypoints_px[static_cast<std::size_t>(b->second)].size();
    });
    all += read.matches.size();
    pairs.push_back(std::move(read));
  }
  const std::vector<PairMatches> thin = ThinMatches(pairs, keypoints_px);
  for (const PairMatches& pair : thin) left += pair.matches.size();
  if (static_cast<double>(left) > kWorthwhile * static_cast<double>(all)) return false;
  whole.CopyTo(thinned);
  std::vector<VerifiedMatchesLeft> rows;
  for (const PairMatches& pair : thin)
    rows.push_back({image_of[static_cast<std::size_t>(pair.photo1)], image_of[static_cast<std::size_t>(pair.photo2)],
                    pair.matches});
  ColmapDatabase(thinned).KeepOfVerified(rows);
  return true;
}

}  // namespace lumi
