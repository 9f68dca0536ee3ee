#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>

#include "reconstruct/colmap_database.h"
#include "reconstruct/own_features.h"
#include "reconstruct/pair_geometry.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/tracks/match_bytes.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// The largest spots of each photo, which are matched first: a pair that has fewer of them in common than kCoarseMatches
// is put off. Spots stand in the database in the order of their size.
constexpr Eigen::Index kCoarseFeatures = 500;
constexpr std::size_t kCoarseMatches = 4;
// Pairs that were put off are matched after all where one of their photos has fewer verified partners.
constexpr int kWantedPartners = 6;
// Pairs that are written at a time.
constexpr std::size_t kBatch = 64;

struct MatchPhoto {
  std::int64_t id = 0;
  std::vector<Eigen::Vector2d> keypoints;
  ByteDescriptors descriptors;
  Camera camera;
  bool focal_is_known = false;
};

struct OpenPair {
  int a = 0, b = 0;  // photos, that with the lower id first
  bool put_off = false;
  bool done = false;  // by an earlier run, which something ended
};

class OwnMatcher {
 public:
  OwnMatcher(const std::vector<std::string>& names, const fs::path& database, const ColmapJob& job)
      : job_(job), db_(database), partners_(names.size(), 0) {
    std::map<std::string, DatabaseImage> image_of;
    for (const auto& image : db_.Images()) image_of[image.name] = image;
    std::map<std::int64_t, DatabaseCamera> camera_of;
    for (const auto& camera : db_.Cameras()) camera_of[camera.id] = camera;
    for (const auto& name : names) {
      MatchPhoto photo;
      if (const auto image = image_of.find(name); image != image_of.end()) {
        photo.id = image->second.id;
        photo.keypoints = db_.Keypoints(photo.id);
        photo.descriptors = db_.Descriptors(photo.id);
        const DatabaseCamera& camera = camera_of[image->second.camera_id];
        photo.camera = camera.camera;
        photo.focal_is_known = camera.focal_is_known;
      }
      photos_.push_back(std::move(photo));
    }
  }

  void Match(const std::vector<std::pair<int, int>>& wanted) {
    std::vector<OpenPair> pairs = Wanted(wanted);
    ParallelEach(pairs.size(), 8, [&](std::size_t i) { pairs[i].put_off = SharesLittle(pairs[i]); });
    CountPartners(pairs);
    const auto open = std::ranges::count_if(pairs, [](const OpenPair& p) { return !p.done; });
    Progress progress(job_.sink, "matching photos", static_cast<long>(open));
    std::vector<OpenPair> first, second, skipped;
    for (const OpenPair& p : pairs)
      if (!p.done && !p.put_off) first.push_back(p);
    MatchAll(first, true, progress);
    // A photo with few partners is matched with all its features: its largest spots alone do not decide.
    std::size_t put_off = 0;
    for (const OpenPair& p : pairs) {
      if (!p.put_off) continue;
      const bool matched = std::min(Partners(p.a), Partners(p.b)) < kWantedPartners;
      put_off += !matched;
      if (!p.done) (matched ? second : skipped).push_back(p);
    }
    MatchAll(second, false, progress);
    for (std::size_t begin = 0; begin < skipped.size(); begin += kBatch) {
      std::vector<DatabaseMatches> none;
      for (std::size_t i = begin; i < std::min(skipped.size(), begin + kBatch); ++i)
        none.push_back(Nothing(skipped[i]));
      db_.AddPairs(none);
    }
    progress.Step(static_cast<long>(skipped.size()));
    if (put_off > 0)
      job_.sink.Message(
          fmt::format("{} of {} pairs of photos were not matched: of their {} largest features fewer than "
                      "{} are alike",
                      put_off, pairs.size(), kCoarseFeatures, kCoarseMatches));
  }

 private:
  const MatchPhoto& Photo(int i) const { return photos_[static_cast<std::size_t>(i)]; }
  int Partners(int i) const { return partners_[static_cast<std::size_t>(i)]; }

  // Those of photos that are there.
  std::vector<OpenPair> Wanted(const std::vector<std::pair<int, int>>& wanted) const {
    std::set<std::pair<std::int64_t, std::int64_t>> done, seen;
    for (const DatabasePair& pair : db_.MatchedPairs()) done.emplace(pair.image1, pair.image2);
    std::vector<OpenPair> pairs;
    for (auto [a, b] : wanted) {
      if (Photo(a).id == 0 || Photo(b).id == 0) continue;
      if (Photo(a).id > Photo(b).id) std::swap(a, b);
      const std::pair ids(Photo(a).id, Photo(b).id);
      if (seen.insert(ids).second) pairs.push_back({.a = a, .b = b, .done = done.count(ids) > 0});
    }
    return pairs;
  }

  // Only pairs that were not put off count as partners: what is decided by partners must not depend on where an earlier
  // run was ended.
  void CountPartners(const std::vector<OpenPair>& pairs) {
    std::set<std::pair<std::int64_t, std::int64_t>> verified;
    for (const DatabasePair& pair : db_.VerifiedPairs()) verified.emplace(pair.image1, pair.image2);
    for (const OpenPair& p : pairs)
      if (p.done && !p.put_off && verified.count({Photo(p.a).id, Photo(p.b).id})) AddPartners(p);
  }
  void AddPartners(const OpenPair& p) {
    for (const int photo : {p.a, p.b}) ++partners_[static_cast<std::size_t>(photo)];
  }

  bool SharesLittle(const OpenPair& p) const {
    const MatchPhoto &a = Photo(p.a), &b = Photo(p.b);
    // With few features, matching all of them takes no longer than this test.
    if (std::max(a.descriptors.rows(), b.descriptors.rows()) <= 2 * kCoarseFeatures) return false;
    return MatchBytes(a.descriptors, b.descriptors, {.most = kCoarseFeatures}).size() < kCoarseMatches;
  }

  DatabaseMatches Nothing(const OpenPair& p) const {
    DatabaseMatches none{Photo(p.a).id, Photo(p.b).id, {}, {}};
    none.geometry.label = PairLabel::kDegenerate;
    return none;
  }

  DatabaseMatches MatchPair(const OpenPair& p) const {
    const MatchPhoto &a = Photo(p.a), &b = Photo(p.b);
    DatabaseMatches result = Nothing(p);
    result.matches = MatchBytes(a.descriptors, b.descriptors, {});
    const PairGeometryOptions options{.seed = job_.options.seed};
    result.geometry = EstimatePairGeometry({a.keypoints, a.camera, a.focal_is_known},
                                           {b.keypoints, b.camera, b.focal_is_known}, result.matches, options);
    // As COLMAP's matcher has it: what is too little to be verified is not kept.
    if (static_cast<int>(result.matches.size()) < options.min_inliers) result.matches.clear();
    return result;
  }

  void MatchAll(const std::vector<OpenPair>& pairs, bool count, Progress& progress) {
    for (std::size_t first = 0; first < pairs.size(); first += kBatch) {
      std::vector<DatabaseMatches> batch(std::min(kBatch, pairs.size() - first));
      ParallelEach(batch.size(), 1, [&](std::size_t i) {
        batch[i] = MatchPair(pairs[first + i]);
        progress.Step();
      });
      db_.AddPairs(batch);
      for (std::size_t i = 0; i < batch.size(); ++i)
        if (count && !batch[i].geometry.inliers.empty()) AddPartners(pairs[first + i]);
    }
  }

  const ColmapJob& job_;
  ColmapDatabase db_;
  std::vector<MatchPhoto> photos_;
  std::vector<int> partners_;  // of each photo: pairs with verified matches, none that was put off
};

}  // namespace

void MatchOwnFeatures(const std::vector<std::string>& names, const std::vector<std::pair<int, int>>& pairs,
                      const fs::path& database, const ColmapJob& job) {
  OwnMatcher(names, database, job).Match(pairs);
}

}  // namespace lumi
