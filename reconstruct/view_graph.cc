#include "reconstruct/view_graph.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>

#include "reconstruct/colmap_database.h"
#include "scene/program/memory.h"
#include "scene/tracks/vlad.h"

namespace lumi {
namespace {

constexpr int kNearByGps = 12;
// Photos with a third of all their partners in common probably see one another.
constexpr double kSharedPartners = 1.0 / 3;
// What is added a photo by common partners, and across parts.
constexpr std::size_t kMoreByPartners = 8;
constexpr int kMoreAcross = 10;
// Fewer verified matches join two parts weakly (COLMAP's mapper wants 30 inliers to place a photo).
constexpr int kStrong = 30;

PhotoPairs InOrder(PhotoPairs pairs) {
  for (auto& [a, b] : pairs)
    if (a > b) std::swap(a, b);
  std::ranges::sort(pairs);
  const auto repeated = std::ranges::unique(pairs);
  pairs.erase(repeated.begin(), repeated.end());
  std::erase_if(pairs, [](const auto& p) { return p.first == p.second; });
  return pairs;
}

bool Contains(const PhotoPairs& sorted, int a, int b) {
  return std::ranges::binary_search(sorted, std::pair(std::min(a, b), std::max(a, b)));
}

// Which part each photo belongs to, by the lowest photo of it.
std::vector<int> Parts(std::size_t photos, const std::vector<VerifiedPair>& verified) {
  std::vector<int> part(photos);
  std::iota(part.begin(), part.end(), 0);
  const auto root = [&](int i) {
    while (part[static_cast<std::size_t>(i)] != i) {
      int& up = part[static_cast<std::size_t>(i)];
      up = part[static_cast<std::size_t>(up)];
      i = up;
    }
    return i;
  };
  for (const VerifiedPair& pair : verified) {
    if (pair.matches < kStrong) continue;
    const int a = root(pair.a), b = root(pair.b);
    part[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
  }
  for (std::size_t i = 0; i < photos; ++i) part[i] = root(static_cast<int>(i));
  return part;
}

// Photos that share many of their partners.
PhotoPairs ByPartners(std::size_t photos, const PhotoPairs& tried, const std::vector<VerifiedPair>& verified) {
  std::vector<std::set<int>> partners(photos);
  for (const VerifiedPair& pair : verified) {
    partners[static_cast<std::size_t>(pair.a)].insert(pair.b);
    partners[static_cast<std::size_t>(pair.b)].insert(pair.a);
  }
  PhotoPairs more;
  for (std::size_t i = 0; i < photos; ++i) {
    const auto self = static_cast<int>(i);
    std::map<int, int> common;
    for (const int partner : partners[i])
      for (const int other : partners[static_cast<std::size_t>(partner)])
        if (other != self && !Contains(tried, self, other)) ++common[other];
    std::vector<std::pair<double, int>> ranked;  // by the share of common partners, negative
    for (const auto& [other, n] : common) {
      const auto both = partners[i].size() + partners[static_cast<std::size_t>(other)].size();
      const double share = n / (static_cast<double>(both) - n);
      if (share >= kSharedPartners) ranked.emplace_back(-share, other);
    }
    std::ranges::sort(ranked);
    for (std::size_t k = 0; k < std::min(kMoreByPartners, ranked.size()); ++k)
      more.emplace_back(self, ranked[k].second);
  }
  return more;
}

}  // namespace

PhotoPairs Joined(PhotoPairs a, const PhotoPairs& b) {
  a.insert(a.end(), b.begin(), b.end());
  return InOrder(std::move(a));
}

ViewGraph::ViewGraph(const std::vector<std::string>& names, const std::filesystem::path& database, std::uint64_t seed,
                     ProgressSink& sink) {
  const ColmapDatabase db(database);
  std::map<std::string, std::int64_t> id_of;
  for (const DatabaseImage& image : db.Images()) id_of[image.name] = image.id;
  const VladOptions options{.seed = seed};
  // The vectors, and as much again while they are made.
  RequireMemory(2 * sizeof(float) * static_cast<std::uint64_t>(options.words) * kByteDescriptorLength * names.size(),
                database, "give fewer photos, or in the order they were taken in: --matching sequential");
  Progress progress(sink, "comparing photos", 2 * static_cast<long>(names.size()));  // each is read twice
  vectors_ = DescribePhotos(
      names.size(),
      [&](std::size_t i) {
        progress.Step();
        const auto id = id_of.find(names[i]);
        return id == id_of.end() ? ByteDescriptors(0, kByteDescriptorLength) : db.Descriptors(id->second);
      },
      options);
}

ViewGraph::ViewGraph(Eigen::MatrixXf vectors) : vectors_(std::move(vectors)) {}

PhotoPairs ViewGraph::Similar(int most, ProgressSink& sink) const {
  Progress progress(sink, "looking for photos that look alike", static_cast<long>(vectors_.cols()));
  const auto similar = MostSimilar(vectors_, most, {.progress = &progress});
  PhotoPairs pairs;
  for (std::size_t i = 0; i < similar.size(); ++i)
    for (const int other : similar[i]) pairs.emplace_back(static_cast<int>(i), other);
  return InOrder(std::move(pairs));
}

PhotoPairs ViewGraph::AcrossParts(const PhotoPairs& tried, const std::vector<VerifiedPair>& verified,
                                  ProgressSink& sink) const {
  const auto n = static_cast<std::size_t>(vectors_.cols());
  const std::vector<int> part = Parts(n, verified);
  std::map<int, int> size;
  for (const int p : part) ++size[p];
  const int largest = std::ranges::max_element(size, {}, [](const auto& s) { return s.second; })->first;
  std::vector<int> apart;
  for (std::size_t i = 0; i < n; ++i)
    if (part[i] != largest) apart.push_back(static_cast<int>(i));
  if (apart.empty()) return {};
  std::vector<std::vector<int>> tried_with(n);  // ascending: `tried` is sorted
  for (const auto& [a, b] : tried) tried_with[static_cast<std::size_t>(b)].push_back(a);
  for (const auto& [a, b] : tried) tried_with[static_cast<std::size_t>(a)].push_back(b);
  const auto may = [&](int i, int j) {
    return part[static_cast<std::size_t>(i)] != part[static_cast<std::size_t>(j)] &&
           !std::ranges::binary_search(tried_with[static_cast<std::size_t>(i)], j);
  };
  Progress progress(sink, "looking for what joins parts", std::ssize(apart));
  const auto similar = MostSimilar(vectors_, kMoreAcross, {apart, may, &progress});
  PhotoPairs more;
  for (std::size_t i = 0; i < apart.size(); ++i)
    for (const int j : similar[i]) more.emplace_back(apart[i], j);
  return more;
}

PhotoPairs ViewGraph::Next(const PhotoPairs& tried, const std::vector<VerifiedPair>& verified,
                           ProgressSink& sink) const {
  if (vectors_.cols() == 0) return {};
  PhotoPairs more = ByPartners(static_cast<std::size_t>(vectors_.cols()), tried, verified);
  const PhotoPairs across = AcrossParts(tried, verified, sink);
  more.insert(more.end(), across.begin(), across.end());
  return InOrder(std::move(more));
}

PhotoPairs NearByGps(const std::vector<InputPhoto>& photos) {
  std::vector<int> known;
  for (std::size_t i = 0; i < photos.size(); ++i)
    if (photos[i].gps) known.push_back(static_cast<int>(i));
  if (known.size() < 2 || 2 * known.size() < photos.size()) return {};
  // On a sphere: no pole and no date line is near anything else.
  const auto place = [&](int i) {
    const GpsPosition& gps = *photos[static_cast<std::size_t>(i)].gps;
    const double latitude = gps.latitude_deg * std::numbers::pi / 180,
                 longitude = gps.longitude_deg * std::numbers::pi / 180;
    return Eigen::Vector3d(std::cos(latitude) * std::cos(longitude), std::cos(latitude) * std::sin(longitude),
                           std::sin(latitude));
  };
  std::vector<Eigen::Vector3d> places;
  for (const int i : known) places.push_back(place(i));
  PhotoPairs pairs;
  std::vector<std::pair<double, int>> near;
  for (std::size_t i = 0; i < known.size(); ++i) {
    near.clear();
    for (std::size_t j = 0; j < known.size(); ++j)
      if (i != j) near.emplace_back((places[i] - places[j]).squaredNorm(), known[j]);
    const auto end = near.begin() + std::min<std::ptrdiff_t>(kNearByGps, std::ssize(near));
    std::partial_sort(near.begin(), end, near.end());
    for (auto it = near.begin(); it != end; ++it) pairs.emplace_back(known[i], it->second);
  }
  return InOrder(std::move(pairs));
}

}  // namespace lumi
