#include "scene/tracks/match_photos.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/calib3d.hpp>

#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"
#include "scene/tracks/match_descriptors.h"
#include "scene/tracks/sift.h"

namespace lumi {
namespace {

constexpr double kConfidence = 0.9999;
constexpr int kRansacIterations = 5000;
// Features of a photo that choose its partners, and matches among them below which two photos show nothing in common.
constexpr Eigen::Index kPreemptiveFeatures = 256;
constexpr int kPreemptiveMatches = 4;

struct Features {
  std::vector<Eigen::Vector2d> x_px;  // of the photo itself
  std::vector<std::array<std::uint8_t, 3>> color;
  Descriptors descriptors;  // RootSIFT
  double scale = 1;         // scaled photo / photo
  Eigen::Vector2i size_px = Eigen::Vector2i::Zero();
};

using Match = DescriptorMatch;

struct PairResult {
  std::vector<Match> verified;
  int matches = 0;
};

Features FindFeatures(const FrameSource& source, int i, const MatchPhotosOptions& o) {
  const auto loaded = tracks_internal::LoadFrame(source, i);
  const Image8& rgb = loaded.image;
  Features f;
  f.size_px = {rgb.width, rgb.height};
  SiftFeatures sift = FindSift(rgb, loaded.mask, {.max_features = o.max_features, .max_size_px = o.max_size_px});
  f.scale = sift.scale;
  f.descriptors = std::move(sift.descriptors);
  for (const SiftFeature& feature : sift.features) {
    const int u = static_cast<int>(feature.x_px.x()), v = static_cast<int>(feature.x_px.y());
    f.x_px.push_back(feature.x_px);
    f.color.push_back(
        {rgb.At(u, v, 0), rgb.At(u, v, rgb.channels == 3 ? 1 : 0), rgb.At(u, v, rgb.channels == 3 ? 2 : 0)});
  }
  return f;
}

// The pairs in which one photo is among the other's best partners.
std::vector<std::pair<int, int>> ChoosePairs(const std::vector<Features>& features,
                                             const std::vector<std::pair<int, int>>& all, const MatchPhotosOptions& o,
                                             ProgressSink& sink) {
  std::vector<int> matches(all.size(), 0);
  Progress progress(sink, "choosing pairs of photos", static_cast<long>(all.size()));
  ParallelEach(all.size(), 16, [&](std::size_t i) {
    const auto a = static_cast<std::size_t>(all[i].first), b = static_cast<std::size_t>(all[i].second);
    matches[i] = static_cast<int>(
        MatchDescriptors(features[a].descriptors, features[b].descriptors, o.ratio, kPreemptiveFeatures).size());
    progress.Step();
  });
  std::vector<std::vector<std::size_t>> of_photo(features.size());
  for (std::size_t i = 0; i < all.size(); ++i)
    if (matches[i] >= kPreemptiveMatches)
      for (const int photo : {all[i].first, all[i].second}) of_photo[static_cast<std::size_t>(photo)].push_back(i);
  std::vector<char> chosen(all.size(), 0);
  for (auto& candidates : of_photo) {
    std::stable_sort(candidates.begin(), candidates.end(),
                     [&](std::size_t i, std::size_t j) { return matches[i] > matches[j]; });
    for (std::size_t k = 0; k < candidates.size() && k < static_cast<std::size_t>(o.partners); ++k)
      chosen[candidates[k]] = 1;
  }
  std::vector<std::pair<int, int>> pairs;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (chosen[i]) pairs.push_back(all[i]);
  return pairs;
}

// Those that one fundamental matrix explains, or one homography where there is none (equal photos, a camera that only
// turned, a plane alone: the fundamental matrix is not determined there).
std::vector<Match> Verify(const Features& a, const Features& b, const std::vector<Match>& matches,
                          const MatchPhotosOptions& o, std::uint64_t seed) {
  if (static_cast<int>(matches.size()) < o.min_matches) return {};
  std::vector<cv::Point2d> x, y;
  for (const Match& m : matches) {
    const Eigen::Vector2d p = a.scale * a.x_px[static_cast<std::size_t>(m.a)],
                          q = b.scale * b.x_px[static_cast<std::size_t>(m.b)];
    x.emplace_back(p.x(), p.y());
    y.emplace_back(q.x(), q.y());
  }
  cv::UsacParams params;
  params.confidence = kConfidence;
  params.isParallel = false;
  params.maxIterations = kRansacIterations;
  params.randomGeneratorState = static_cast<int>(seed % 1000003);
  params.threshold = o.epipolar_px;
  const auto inliers = [&](auto&& estimate) {
    cv::Mat mask;
    std::vector<Match> kept;
    try {
      if (estimate(mask).empty()) return kept;
    } catch (const cv::Exception&) {  // a degenerate set of matches
      return kept;
    }
    for (std::size_t i = 0; i < matches.size() && i < mask.total(); ++i)
      if (mask.at<unsigned char>(static_cast<int>(i))) kept.push_back(matches[i]);
    return kept;
  };
  std::vector<Match> best = inliers([&](cv::Mat& mask) { return cv::findFundamentalMat(x, y, mask, params); });
  if (static_cast<int>(best.size()) < o.min_matches)
    best = inliers([&](cv::Mat& mask) { return cv::findHomography(x, y, mask, params); });
  if (static_cast<int>(best.size()) < o.min_matches) best.clear();
  return best;
}

// Components of features; each knows its photos, so that no two features of one photo come together.
class Components {
 public:
  explicit Components(const std::vector<std::size_t>& features_of_photo) {
    for (std::size_t photo = 0; photo < features_of_photo.size(); ++photo) {
      first_.push_back(photos_.size());
      for (std::size_t i = 0; i < features_of_photo[photo]; ++i) photos_.push_back({static_cast<int>(photo)});
    }
    parent_.resize(photos_.size());
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  std::size_t Id(int photo, int feature) const {
    return first_[static_cast<std::size_t>(photo)] + static_cast<std::size_t>(feature);
  }
  std::size_t Root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  bool Join(std::size_t i, std::size_t j) {
    i = Root(i);
    j = Root(j);
    if (i == j) return true;
    std::vector<int> both;
    both.reserve(photos_[i].size() + photos_[j].size());
    std::merge(photos_[i].begin(), photos_[i].end(), photos_[j].begin(), photos_[j].end(), std::back_inserter(both));
    if (std::adjacent_find(both.begin(), both.end()) != both.end()) return false;
    if (photos_[i].size() < photos_[j].size()) std::swap(i, j);
    parent_[j] = i;
    photos_[i] = std::move(both);
    photos_[j].clear();
    return true;
  }

 private:
  std::vector<std::size_t> parent_, first_;
  std::vector<std::vector<int>> photos_;  // of a root, ascending
};

}  // namespace

std::optional<std::string> Validate(const MatchPhotosOptions& o) {
  if (o.max_features < 8) return "features a photo: 8 and more";
  if (o.max_size_px < 16) return "the size in which features are sought: 16 pixels and more";
  if (!(o.ratio > 0 && o.ratio <= 1)) return "the ratio of distances: above 0, up to 1";
  if (!(o.epipolar_px > 0)) return "the distance to the epipolar line: above 0 pixels";
  if (o.min_matches < 8) return "verified matches that a pair needs: 8 and more";
  if (o.min_length < 2) return "a track's minimum length: 2 photos and more";
  if (o.partners < 0) return "partners of a photo: 0 (all photos) and more";
  return std::nullopt;
}

Tracks MatchPhotos(const FrameSource& source, const MatchPhotosOptions& options, ProgressSink& sink,
                   MatchPhotosSummary* summary) {
  if (const auto wrong = Validate(options)) throw UsageError(*wrong);
  const Stopwatch watch;
  const int n = source.count();
  std::vector<std::pair<int, int>> pairs = options.pairs;
  for (const auto& [a, b] : pairs)
    if (a < 0 || a >= b || b >= n)
      throw UsageError(fmt::format("photos {} and {} are no pair of the {} photos", a, b, n));
  if (pairs.empty())
    for (int a = 0; a < n; ++a)
      for (int b = a + 1; b < n; ++b) pairs.emplace_back(a, b);
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());

  std::vector<Features> features(static_cast<std::size_t>(n));
  {
    Progress progress(sink, "finding features", n);
    const auto find = [&](std::size_t i) {
      features[i] = FindFeatures(source, static_cast<int>(i), options);
      progress.Step();
    };
    if (source.in_order)
      for (std::size_t i = 0; i < features.size(); ++i) find(i);
    else
      ParallelEach(features.size(), 1, [&](std::size_t i) { find(i); });
  }
  if (options.partners > 0 && options.pairs.empty()) pairs = ChoosePairs(features, pairs, options, sink);
  std::vector<PairResult> results(pairs.size());
  {
    Progress progress(sink, "matching photos", static_cast<long>(pairs.size()));
    ParallelEach(pairs.size(), 1, [&](std::size_t i) {
      const auto [a, b] = pairs[i];
      const Features& fa = features[static_cast<std::size_t>(a)];
      const Features& fb = features[static_cast<std::size_t>(b)];
      const std::vector<Match> matches = MatchDescriptors(fa.descriptors, fb.descriptors, options.ratio,
                                                          std::max(fa.descriptors.rows(), fb.descriptors.rows()));
      results[i].matches = static_cast<int>(matches.size());
      results[i].verified = Verify(fa, fb, matches, options, options.seed + 1 + 7919 * static_cast<std::uint64_t>(i));
      progress.Step();
    });
  }

  MatchPhotosSummary s;
  struct Link {
    float similarity;
    std::size_t a, b;
  };
  std::vector<Link> links;
  std::vector<std::size_t> counts;
  for (const Features& f : features) {
    counts.push_back(f.x_px.size());
    s.features.push_back(static_cast<int>(f.x_px.size()));
  }
  Components components(counts);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto [a, b] = pairs[i];
    s.pairs.push_back({a, b, results[i].matches, static_cast<int>(results[i].verified.size())});
    for (const Match& m : results[i].verified)
      links.push_back({m.similarity, components.Id(a, m.a), components.Id(b, m.b)});
  }
  // Surest first: where two points of one photo would come together, the weaker link is the wrong one.
  std::sort(links.begin(), links.end(), [](const Link& x, const Link& y) {
    return std::tie(y.similarity, x.a, x.b) < std::tie(x.similarity, y.a, y.b);
  });
  for (const Link& link : links) s.conflicts += !components.Join(link.a, link.b);

  Tracks tracks;
  std::vector<std::ptrdiff_t> track_of(std::accumulate(counts.begin(), counts.end(), std::size_t{0}), -1);
  for (int photo = 0; photo < n; ++photo) {
    const Features& f = features[static_cast<std::size_t>(photo)];
    tracks.frames.push_back({source.names[static_cast<std::size_t>(photo)], f.size_px});
    for (std::size_t k = 0; k < f.x_px.size(); ++k) {
      std::ptrdiff_t& track = track_of[components.Root(components.Id(photo, static_cast<int>(k)))];
      if (track < 0) {
        track = static_cast<std::ptrdiff_t>(tracks.tracks.size());
        tracks.tracks.push_back({{}, f.color[k]});
      }
      tracks.tracks[static_cast<std::size_t>(track)].observations.push_back({photo, f.x_px[k]});
    }
  }
  std::erase_if(tracks.tracks,
                [&](const Track& t) { return static_cast<int>(t.observations.size()) < options.min_length; });

  std::vector<std::string> blank;
  for (std::size_t i = 0; i < features.size(); ++i)
    if (features[i].x_px.empty()) blank.push_back(source.names[i]);
  if (!blank.empty())
    sink.Message(fmt::format("{} photo{} without a feature, {} first: blank, blurred, masked or too small",
                             blank.size(), blank.size() > 1 ? "s" : "", blank.front()));
  s.seconds = watch.Seconds();
  if (summary) *summary = std::move(s);
  return tracks;
}

}  // namespace lumi
