#include "reconstruct/groups.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "reconstruct/merge_models.h"
#include "scene/geometry/median.h"

namespace lumi {
namespace {

// A tie is thin where it has so many times fewer points than the median edge of the tree.
constexpr double kThin = 5;
constexpr std::size_t kMostTies = 20;
// Single photos are left to standing.h.
constexpr std::size_t kLeastGroup = 2;
// A place found anew must explain so many times more common points.
constexpr double kExplainsGroup = 1.3;

struct Tie {
  std::int32_t a = 0, b = 0;
  int points = 0;
};

class Sets {
 public:
  explicit Sets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::int32_t Find(std::int32_t v) {
    while (parent_[static_cast<std::size_t>(v)] != v)
      v = parent_[static_cast<std::size_t>(v)] =
          parent_[static_cast<std::size_t>(parent_[static_cast<std::size_t>(v)])];
    return v;
  }
  bool Join(std::int32_t a, std::int32_t b) {
    a = Find(a), b = Find(b);
    if (a == b) return false;
    parent_[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    return true;
  }

 private:
  std::vector<std::int32_t> parent_;
};

// The edges of a maximum spanning tree of the views by common points, the strongest first; views that share none hang
// on view 0 by none.
std::vector<Tie> StrongestTies(const Scene& scene) {
  std::unordered_map<std::uint64_t, int> shared;
  for (const Point& point : scene.points)
    for (std::size_t i = 0; i < point.track.size(); ++i)
      for (std::size_t j = i + 1; j < point.track.size(); ++j) {
        const auto [a, b] = std::minmax(point.track[i].view.value, point.track[j].view.value);
        ++shared[(static_cast<std::uint64_t>(a) << 32U) | static_cast<std::uint32_t>(b)];
      }
  std::vector<Tie> ties;
  for (const auto& [views, points] : shared)
    ties.push_back({static_cast<std::int32_t>(views >> 32U), static_cast<std::int32_t>(views & 0xffffffffU), points});
  std::ranges::sort(ties, {}, [](const Tie& tie) { return std::tuple(-tie.points, tie.a, tie.b); });
  for (std::size_t v = 1; v < scene.views.size(); ++v) ties.push_back({0, static_cast<std::int32_t>(v), 0});
  Sets sets(scene.views.size());
  std::vector<Tie> tree;
  for (const Tie& tie : ties)
    if (sets.Join(tie.a, tie.b)) tree.push_back(tie);
  return tree;
}

// The smaller of the two sides that the tree falls into without one of its edges.
std::vector<char> SmallerSide(const std::vector<Tie>& tree, std::size_t without, std::size_t views) {
  Sets sets(views);
  for (std::size_t i = 0; i < tree.size(); ++i)
    if (i != without) sets.Join(tree[i].a, tree[i].b);
  std::vector<char> side(views);
  for (std::size_t v = 0; v < views; ++v)
    side[v] = sets.Find(static_cast<std::int32_t>(v)) == sets.Find(tree[without].b);
  if (2 * static_cast<std::size_t>(std::ranges::count(side, 1)) > views)
    for (char& s : side) s = !s;
  return side;
}

// A scene cut in two, and the verified matches between its sides.
struct Halves {
  Scene rest, group;
  std::vector<ViewMatches> matches;  // views of `rest`, then those of `group`
};

Halves CutAt(const Scene& scene, const std::vector<char>& in_group, const std::vector<ViewMatches>& matches) {
  Halves halves;
  std::vector<std::int32_t> number(scene.views.size());
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    Scene& side = in_group[v] ? halves.group : halves.rest;
    number[v] = static_cast<std::int32_t>(side.views.size());
    side.views.push_back(scene.views[v]);
  }
  halves.rest.image_folder = scene.image_folder;
  halves.rest.cameras = halves.group.cameras = scene.cameras;
  const auto is_in_group = [&](ViewId view) { return in_group[static_cast<std::size_t>(view.value)] != 0; };
  for (const Point& point : scene.points) {
    Point of_rest, of_group;
    for (const Observation& o : point.track)
      (is_in_group(o.view) ? of_group : of_rest)
          .track.push_back({ViewId{number[static_cast<std::size_t>(o.view.value)]}, o.x_px});
    of_rest.x_in_world = of_group.x_in_world = point.x_in_world;
    if (of_rest.track.size() >= 2) halves.rest.points.push_back(std::move(of_rest));
    if (of_group.track.size() >= 2) halves.group.points.push_back(std::move(of_group));
  }
  const auto among_both = [&](ViewId view) {
    const std::int32_t n = number[static_cast<std::size_t>(view.value)];
    return ViewId{is_in_group(view) ? static_cast<std::int32_t>(halves.rest.views.size()) + n : n};
  };
  for (const ViewMatches& m : matches)
    if (is_in_group(m.a) != is_in_group(m.b)) halves.matches.push_back({among_both(m.a), among_both(m.b), m.px});
  return halves;
}

// Points that photos of both sides see.
int PointsOfBoth(const Scene& scene, const std::vector<char>& in_group) {
  return static_cast<int>(std::ranges::count_if(scene.points, [&](const Point& point) {
    const auto in = std::ranges::count_if(
        point.track, [&](const Observation& o) { return in_group[static_cast<std::size_t>(o.view.value)] != 0; });
    return in > 0 && in < std::ssize(point.track);
  }));
}

// The scene with its group joined to the rest as `tie` has it. Views are sorted by name before and after.
Scene Rejoined(const Scene& scene, const Halves& halves, const ModelTie& tie) {
  std::map<std::string, CameraId> camera;
  for (const View& view : scene.views) camera[view.name] = view.camera;
  Scene joined =
      JoinModels(halves.rest, halves.group, tie, [](const std::string&, const std::string&) { return true; });
  for (View& view : joined.views) view.camera = camera.at(view.name);
  joined.cameras = scene.cameras;
  TriangulateAnew(joined);
  return joined;
}

}  // namespace

VerifiedGroups VerifyGroups(Scene scene, const std::vector<ViewMatches>& matches) {
  VerifiedGroups verified;
  const std::vector<Tie> tree = StrongestTies(scene);
  std::vector<int> points;
  for (const Tie& tie : tree) points.push_back(tie.points);
  const double thin = Median(std::move(points)) / kThin;
  // The thinnest stand last.
  std::size_t tries = 0;
  for (std::size_t i = tree.size(); i-- > 0 && tree[i].points < thin && tries < kMostTies;) {
    const std::vector<char> in_group = SmallerSide(tree, i, scene.views.size());
    HangingGroup group;
    for (std::size_t v = 0; v < in_group.size(); ++v)
      if (in_group[v]) group.photos.push_back(scene.views[v].name);
    if (group.photos.size() < kLeastGroup) continue;
    ++tries;
    const Halves halves = CutAt(scene, in_group, matches);
    const auto tie = TieModels(halves.rest, halves.group, halves.matches);
    group.points = PointsOfBoth(scene, in_group);
    const bool elsewhere = tie && tie->common_points > kExplainsGroup * tie->agree_unmoved;
    // The points that tie the group to where it stands count as well, also points that only one photo of a side sees.
    group.moved = elsewhere && tie->common_points > kExplainsGroup * group.points;
    if (group.moved) {
      scene = Rejoined(scene, halves, *tie);
      verified.changed = true;
    }
    if (elsewhere || (!tie && group.points < kMinCommonPoints)) verified.groups.push_back(std::move(group));
  }
  verified.scene = std::move(scene);
  return verified;
}

}  // namespace lumi
