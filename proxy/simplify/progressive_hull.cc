#include "proxy/simplify/progressive_hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <queue>
#include <span>

#include "proxy/hull/coverage.h"
#include "proxy/simplify/collapse_rules.h"
#include "proxy/simplify/collapsing_surface.h"
#include "proxy/simplify/enclosed_surface.h"
#include "proxy/simplify/halfspace_program.h"
#include "proxy/simplify/mesh_topology.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

using Eigen::Vector3d;

// Goals along the direction of least volume, in lengths of the edge's surroundings. The first is the linear program as
// it is; where its place turns a face over, one nearer to the edge often does not, at the price of some volume.
constexpr std::array<double, 3> kReaches = {1000, 4, 0};
// Above, places are sought anew when an edge's turn comes; below, as soon as something near it changes, which costs six
// times as much and finds the cheapest edge always.
constexpr std::size_t kEagerFaces = 30000;
// Flat patches add no volume: there the shorter edge goes first. As a volume, it stands back behind slopes of a
// thousandth.
constexpr double kLengthWeight = 1e-3;

// Vertices are drawn inwards against the hull that had this many faces (or against the input): it is nearly as tight as
// the input, and a tenth as large to ask.
constexpr std::size_t kReferenceFaces = 30000;
// ... whenever a tenth of the faces has gone since.
constexpr double kTightenEvery = 0.9;
constexpr int kTightenSweeps = 2;
// How far inwards one move aims, in lengths of the edges around.
constexpr double kInwardReach = 1;
constexpr double kKeptHeight = 0.3;
constexpr int kInwardRounds = 6;
// Below this many faces what counts is that surface alone, not the planes of the faces that go (see
// PlaceAroundEnclosed).
constexpr std::size_t kAroundEnclosedFaces = 6000;
// Places above an edge's middle where its ends may become one, in lengths of the edges around.
constexpr std::array<double, 5> kStartHeights = {0, 0.1, 0.25, 0.5, 1};
constexpr double kFarthestStart = 3;
constexpr std::size_t kCheckedPoints = 500, kCheckedFaces = 3000;
constexpr double kFarthestCheck = 4;  // of the radius of what is enclosed: a tetrahedron around a ball has corners at 3
constexpr double kCheckDepth = 1e-5;  // of the body's size
constexpr double kFarthest = 12;      // a mesh within four sizes of the origin is not moved there
// Less than this share of an edge's length is not worth a move.
constexpr double kLeastGain = 1e-3;

struct Candidate {
  double cost;
  std::int32_t a, b;
  std::uint32_t time;  // of its evaluation, in collapses
  // The cheapest first; ties by index, so that the order is always the same.
  bool operator<(const Candidate& o) const { return cost != o.cost ? cost > o.cost : a != o.a ? a > o.a : b > o.b; }
};

class HullCollapser : private CollapsingSurface {
 public:
  explicit HullCollapser(const Mesh& mesh) : CollapsingSurface(mesh), changed_(mesh.vertices.size(), 0) {}

  using CollapsingSurface::face_count;
  using CollapsingSurface::Result;
  std::size_t programs() const { return programs_; }
  double evaluate_s() const { return evaluate_s_; }

  // One collapse, the cheapest. False: there is none any more.
  bool Step() {
    if (face_count_ <= rebuild_at_) Rebuild();
    for (int attempt = 0; attempt < 2; ++attempt) {
      while (!queue_.empty()) {
        const Candidate c = queue_.top();
        queue_.pop();
        if (around_[Index(c.a)].empty() || around_[Index(c.b)].empty()) continue;
        if (std::max(changed_[Index(c.a)], changed_[Index(c.b)]) > c.time) {
          if (!eager_) Push(c.a, c.b);
          continue;
        }
        const auto place = BestPlace(c.a, c.b);
        if (!place) continue;
        Collapse(c.a, c.b, place->x);
        return true;
      }
      if (changed_since_rebuild_ == 0) return false;
      Rebuild();
    }
    return false;
  }

  // Faces without area carry no plane and hide slits: their shortest edge goes before all else.
  std::size_t RemoveDegenerateFaces() {
    std::size_t removed = 0;
    for (bool more = true; more;) {
      more = false;
      for (std::size_t f = 0; f < faces_.size(); ++f) {
        if (!alive_[f] || area2_[f] > 0) continue;
        std::array<std::size_t, 3> sides = {0, 1, 2};
        std::ranges::sort(sides, [&](std::size_t i, std::size_t j) { return SideLength(f, i) < SideLength(f, j); });
        for (const std::size_t side : sides) {
          const VertexIndex a = faces_[f][side], b = faces_[f][(side + 1) % 3];
          const auto place = Place(a, b);
          if (!place) continue;
          Collapse(a, b, place->x);
          removed += 2;
          more = true;
          break;
        }
      }
    }
    return removed;
  }

  // From here on the vertices may be drawn inwards again, as far as the surface as it is now stays enclosed.
  void KeepEnclosed() {
    std::vector<std::array<VertexIndex, 3>> faces;
    for (std::size_t f = 0; f < faces_.size(); ++f)
      if (alive_[f]) faces.push_back(faces_[f]);
    middle_ = Vector3d::Zero();
    for (const auto& f : faces) middle_ += At(f[0]) / static_cast<double>(faces.size());
    enclosed_six_ = radius_ = 0;
    for (const auto& f : faces) {
      enclosed_six_ += (At(f[0]) - middle_).dot((At(f[1]) - middle_).cross(At(f[2]) - middle_));
      for (const VertexIndex v : f) radius_ = std::max(radius_, (At(v) - middle_).norm());
    }
    enclosed_.emplace(x_, std::move(faces));
  }
  // From here on an edge's new vertex is held by that surface alone.
  void HoldByEnclosedAlone() {
    if (!around_enclosed_) around_enclosed_ = enclosed_.has_value();
  }
  bool keeps_enclosed() const { return enclosed_.has_value(); }

  // Each collapse keeps outside the surface just before, which has grown by all those earlier: much of that room is not
  // needed. Vertices go where the volume is least while what was there before all of it stays inside.
  void Tighten(int sweeps) {
    for (int sweep = 0; sweep < sweeps; ++sweep) {
      CheckInterrupted();
      std::size_t moved = 0;
      for (std::size_t v = 0; v < x_.size(); ++v)
        if (!around_[v].empty() && DrawInwards(static_cast<VertexIndex>(v))) ++moved;
      if (moved == 0) break;
    }
    Rebuild();
  }

  // Whether what was to stay enclosed still is: the surface must wind around points of it, a little within. The rules
  // that hold vertices back rely on tolerances; this test does not, and costs little.
  bool StillEncloses() const {
    if (!enclosed_) return true;
    // A surface folded over itself winds backwards around what lies in the fold: less volume, or vertices far off.
    double six = 0;
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      if (!alive_[f]) continue;
      const Vector3d &a = At(faces_[f][0]), &b = At(faces_[f][1]), &c = At(faces_[f][2]);
      six += (a - middle_).dot((b - middle_).cross(c - middle_));
      if ((a - middle_).norm() > kFarthestCheck * radius_) return false;
    }
    if (six < (1 - 1e-6) * enclosed_six_) return false;
    if (face_count_ > kCheckedFaces) return true;
    const std::vector<Vector3d> points = enclosed_->PointsWithin(kCheckedPoints, kCheckDepth);
    std::atomic<bool> all = true;
    ParallelFor(points.size(), 16, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end && all; ++i) {
        double angle = 0;
        for (std::size_t f = 0; f < faces_.size(); ++f) {
          if (!alive_[f]) continue;
          // The solid angle of a face (Van Oosterom and Strackee 1983).
          const Vector3d a = At(faces_[f][0]) - points[i], b = At(faces_[f][1]) - points[i],
                         c = At(faces_[f][2]) - points[i];
          const double la = a.norm(), lb = b.norm(), lc = c.norm();
          angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
        }
        if (angle < 2 * std::numbers::pi) all = false;
      }
    });
    return all;
  }

 private:
  struct Placement {
    Vector3d x;
    double cost;
  };

  // The planes of the faces around an edge, seen from its middle.
  struct EdgePlanes {
    std::array<HalfSpace, 2 * kMostNeighbours> planes;
    std::size_t count = 0;
    Vector3d middle, uphill = Vector3d::Zero();  // uphill: six times the volume's gradient
    double six_offset = 0, size2 = 0;            // size2: the squared distance of the farthest corner

    double SixVolume(const Vector3d& x) const { return uphill.dot(x - middle) - six_offset; }
    std::span<const HalfSpace> InUnitsOf(double size) {
      for (std::size_t i = 0; i < count; ++i) planes[i].offset /= size;
      return {planes.data(), count};
    }
  };

  EdgePlanes PlanesAround(VertexIndex a, VertexIndex b) const {
    EdgePlanes e;
    e.middle = 0.5 * (At(a) + At(b));
    const auto add = [&](FaceIndex f) {
      const auto& t = faces_[Index(f)];
      for (const VertexIndex v : t) e.size2 = std::max(e.size2, (At(v) - e.middle).squaredNorm());
      if (!(area2_[Index(f)] > 0)) return;
      const Vector3d& n = normal_[Index(f)];
      const double offset = n.dot(At(t[0]) - e.middle);
      e.planes[e.count++] = {n, offset};
      e.uphill += area2_[Index(f)] * n;
      e.six_offset += area2_[Index(f)] * offset;
    };
    for (const FaceIndex f : around_[Index(a)]) add(f);
    for (const FaceIndex f : around_[Index(b)])
      if (!Has(f, a)) add(f);
    return e;
  }

  // What a place costs beside the volume that it adds.
  double LengthCost(VertexIndex a, VertexIndex b) const {
    const double length = (At(a) - At(b)).norm();
    return kLengthWeight * length * length * length;
  }

  // Where the edge's ends may become one, and what volume that adds. Reads only.
  std::optional<Placement> Place(VertexIndex a, VertexIndex b) const {
    if (!Linked(a, b)) return std::nullopt;
    EdgePlanes around = PlanesAround(a, b);
    const double size = std::sqrt(around.size2), steep = around.uphill.norm();
    if (!(size > 0)) return std::nullopt;
    const std::span<const HalfSpace> planes = around.InUnitsOf(size);
    const Vector3d down = steep > 1e-12 * around.size2 ? Vector3d(-around.uphill / steep) : Vector3d::Zero();
    for (const double reach : kReaches) {
      const auto local = NearestAllowed(reach * down, planes);
      if (!local) return std::nullopt;
      const Vector3d x = around.middle + size * *local;
      if (!IsNear(x) || !FanIsSound(a, b, x)) continue;
      return Placement{x, std::max(0.0, around.SixVolume(x) / 6) + LengthCost(a, b)};
    }
    return std::nullopt;
  }

  // From `start`, which encloses what is to stay enclosed: where the fan holds less, as far as its shape and the
  // enclosed surface allow. Cutting planes: a place is tried, and what it would leave outside is held inside from then
  // on. nullopt: nowhere, or only for a gain below `least_gain`, as a share of a move of `size`.
  std::optional<Vector3d> DrawnInwards(const Vector3d& start, const std::vector<FanSide>& fan, double size,
                                       double worst_before, double reach, double least_gain) const {
    Vector3d uphill = Vector3d::Zero();
    for (const FanSide& s : fan) uphill += (s.p - start).cross(s.q - start);
    const double steep = uphill.norm();
    if (!(steep > 1e-9 * size * size)) return std::nullopt;
    const Vector3d goal = -reach / steep * uphill;
    const auto gains = [&](const Vector3d& step) { return -uphill.dot(step) >= least_gain * steep * size; };

    std::vector<HalfSpace> constraints;
    std::vector<Vector3d> obstacles;
    // In its old plane every face must keep a part of its height: a linear constraint, under which no face turns over.
    for (const FanSide& s : fan) {
      const Vector3d inwards = s.normal.cross(s.q - s.p);
      const double length = inwards.norm();
      if (!(length > 1e-12 * size)) continue;
      const double least = inwards.dot(s.p - start) + kKeptHeight * inwards.dot(s.apex - s.p);
      constraints.push_back({inwards / length, least / (length * size)});
    }
    const auto allowed = [&](const Vector3d& x, bool learn) {
      double worst_after = 1;
      bool shaped = true;
      for (const FanSide& s : fan) {
        const TriangleShape after = ShapeOf(x, s.p, s.q);
        worst_after = std::min(worst_after, after.quality);
        const bool turned =
            s.normal != Vector3d::Zero() && after.area_vector.dot(s.normal) < kLeastTurnCosine * after.area2;
        shaped = shaped && after.quality >= kDegenerateQuality && !turned;
      }
      shaped = shaped && worst_after >= std::min(kLeastQuality, worst_before);
      if (!shaped && !learn) return false;
      bool clear = true;
      for (const FanSide& s : fan) {
        obstacles.clear();
        enclosed_->FindObstacles(start, x, s.p, s.q, obstacles);
        clear = clear && obstacles.empty();
        if (!clear && !learn) return false;
        for (const Vector3d& w : obstacles) {
          // Below the plane of p, q and the new place, by a little so that rounding does not ask for it again.
          const Vector3d n = (s.p - w).cross(s.q - w);
          const double length = n.norm();
          if (length > 1e-12 * size * size)
            constraints.push_back({n / length, (n.dot(w - start) / length + EnclosedSurface::kMargin) / size});
        }
      }
      return clear && shaped;
    };
    Vector3d step = goal * size;
    for (int round = 0; round < kInwardRounds; ++round) {
      const auto local = NearestAllowed(goal, constraints);
      if (!local || local->norm() > 2 * reach) break;
      step = size * *local;
      if (!gains(step)) return std::nullopt;
      const std::size_t known = constraints.size();
      if (allowed(start + step, true)) return start + step;
      if (constraints.size() == known) break;  // its shape is in the way
    }
    for (double share = 0.5; share > 0.05 && gains(share * step); share *= 0.5)
      if (allowed(start + share * step, false)) return start + share * step;
    return std::nullopt;
  }

  bool DrawInwards(VertexIndex v) {
    std::vector<FanSide> fan;
    double size2 = 0, worst_before = 1;
    AddFan(v, -1, fan, size2, worst_before);
    const auto x = DrawnInwards(At(v), fan, std::sqrt(size2), worst_before, kInwardReach, kLeastGain);
    if (!x || !IsNear(*x)) return false;
    MoveTo(v, *x);
    return true;
  }

  // As Place, but held by the enclosed surface alone and not by the planes of the faces that go: around saddles no
  // point is outside of all of those, and elsewhere they keep room that nothing needs. The ends first become one
  // somewhere where nothing is left outside, then that point is drawn inwards.
  std::optional<Placement> PlaceAroundEnclosed(VertexIndex a, VertexIndex b) const {
    if (!Linked(a, b)) return std::nullopt;
    std::vector<FanSide> fan;
    double size2 = 0, worst_before = 1;
    AddFan(a, b, fan, size2, worst_before);
    AddFan(b, a, fan, size2, worst_before);
    const double size = std::sqrt(size2);
    EdgePlanes around = PlanesAround(a, b);
    const Vector3d& middle = around.middle;
    const double steep = around.uphill.norm();
    if (!(size > 0) || !(steep > 1e-9 * size2)) return std::nullopt;
    const auto cost = [&](const Vector3d& x) { return around.SixVolume(x) / 6 + LengthCost(a, b); };
    std::vector<Vector3d> obstacles;
    const auto reaches = [&](const Vector3d& x) {
      for (const VertexIndex end : {a, b}) {
        for (const FaceIndex f : around_[Index(end)]) {
          const auto& t = faces_[Index(f)];
          const std::size_t k = t[0] == end ? 0 : t[1] == end ? 1 : 2;
          if (end == b && Has(f, a)) continue;
          obstacles.clear();
          enclosed_->FindObstacles(At(end), x, At(t[(k + 1) % 3]), At(t[(k + 2) % 3]), obstacles);
          if (!obstacles.empty()) return false;
        }
      }
      return true;
    };
    std::optional<Vector3d> start;
    if (const auto outside = NearestAllowed(Vector3d::Zero(), around.InUnitsOf(size));
        outside && outside->norm() < kFarthestStart)
      start = middle + size * *outside;
    for (const double height : kStartHeights) {
      if (start) break;
      const Vector3d x = middle + height * size / steep * around.uphill;
      if (reaches(x)) start = x;
    }
    for (const Vector3d& x : {At(a), At(b)}) {
      if (start) break;
      if (reaches(x)) start = x;
    }
    if (!start) return std::nullopt;
    const double reach = kInwardReach + (*start - middle).norm() / size;
    const auto x = DrawnInwards(*start, fan, size, worst_before, reach, -std::numeric_limits<double>::infinity());
    if (x && IsNear(*x)) return Placement{*x, cost(*x)};
    if (!x && IsNear(*start) && FanIsSound(a, b, *start)) return Placement{*start, cost(*start)};
    return std::nullopt;
  }

  // Beyond a few sizes of the body a vertex helps nobody.
  static bool IsNear(const Vector3d& x) { return x.cwiseAbs().maxCoeff() < kFarthest; }

  std::optional<Placement> BestPlace(VertexIndex a, VertexIndex b) const {
    const auto outside = Place(a, b);
    // Where that adds nothing there is nothing to gain.
    if (!around_enclosed_ || (outside && outside->cost <= kLengthWeight * 1.001 * std::pow((At(a) - At(b)).norm(), 3)))
      return outside;
    const auto around = PlaceAroundEnclosed(a, b);
    return around && (!outside || around->cost < outside->cost) ? around : outside;
  }

  void Push(VertexIndex a, VertexIndex b) {
    ++programs_;
    if (const auto place = BestPlace(a, b)) queue_.push({place->cost, std::min(a, b), std::max(a, b), time_});
  }

  // Every edge's place, in parallel.
  void Rebuild() {
    const Stopwatch watch;
    std::vector<std::pair<VertexIndex, VertexIndex>> edges;
    edges.reserve(face_count_ * 3 / 2);
    for (std::size_t f = 0; f < faces_.size(); ++f) {
      if (!alive_[f]) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const VertexIndex a = faces_[f][k], b = faces_[f][(k + 1) % 3];
        if (a < b) edges.emplace_back(a, b);
      }
    }
    constexpr double kRefused = std::numeric_limits<double>::infinity();
    std::vector<double> costs(edges.size());
    ParallelEach(edges.size(), 64, [&](std::size_t e) {
      const auto place = BestPlace(edges[e].first, edges[e].second);
      costs[e] = place ? place->cost : kRefused;
    });
    std::vector<Candidate> candidates;
    candidates.reserve(edges.size());
    for (std::size_t e = 0; e < edges.size(); ++e)
      if (costs[e] < kRefused) candidates.push_back({costs[e], edges[e].first, edges[e].second, time_});
    programs_ += edges.size();
    queue_ = std::priority_queue<Candidate>(std::less<Candidate>(), std::move(candidates));
    eager_ = face_count_ <= kEagerFaces && !around_enclosed_;
    rebuild_at_ = eager_ || around_enclosed_ ? 0 : std::max(kEagerFaces, face_count_ / 2);
    changed_since_rebuild_ = 0;
    evaluate_s_ += watch.Seconds();
  }

  // b becomes a, at x.
  void Collapse(VertexIndex a, VertexIndex b, const Vector3d& x) {
    ++time_;
    ++changed_since_rebuild_;
    const std::vector<VertexIndex> new_neighbours = Merge(a, b, x);
    changed_[Index(a)] = time_;
    ForEachNeighbour(a, [&](VertexIndex p) { changed_[Index(p)] = time_; });
    if (rebuild_at_ == std::numeric_limits<std::size_t>::max()) return;  // no queue yet
    if (!eager_) {
      for (const VertexIndex p : new_neighbours) Push(a, p);
      return;
    }
    std::vector<std::pair<VertexIndex, VertexIndex>> edges;
    ForEachNeighbour(a, [&](VertexIndex p) {
      ForEachNeighbour(p, [&](VertexIndex q) { edges.emplace_back(std::min(p, q), std::max(p, q)); });
    });
    std::ranges::sort(edges);
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    for (const auto& [p, q] : edges) Push(p, q);
  }

  std::vector<std::uint32_t> changed_;  // when a face around the vertex changed last, in collapses
  std::priority_queue<Candidate> queue_;
  std::size_t programs_ = 0, changed_since_rebuild_ = 0;
  std::size_t rebuild_at_ = std::numeric_limits<std::size_t>::max();
  std::uint32_t time_ = 0;
  bool eager_ = false, around_enclosed_ = false;
  std::optional<EnclosedSurface> enclosed_;
  Vector3d middle_ = Vector3d::Zero();    // of what is enclosed
  double enclosed_six_ = 0, radius_ = 0;  // six times its volume; the distance of its farthest vertex from there
  double evaluate_s_ = 0;
};

}  // namespace

namespace {

// nullopt: something was left outside, by a check that is independent of how places are found.
std::optional<std::vector<KeptHull>> TryToKeepHull(const Mesh& mesh, const std::vector<std::size_t>& faces,
                                                   bool tighten, ProgressSink& progress, ProgressiveHullSummary& s) {
  const Stopwatch watch;
  std::vector<std::size_t> order(faces.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t i, std::size_t j) { return faces[i] > faces[j]; });

  HullCollapser collapser(mesh);
  std::vector<KeptHull> hulls(faces.size());
  s.collapses = collapser.RemoveDegenerateFaces() / 2;
  const std::size_t least = faces.empty() ? 0 : faces[order.back()];
  Progress steps(progress, "keeping the hull",
                 static_cast<long>(collapser.face_count() > least ? (collapser.face_count() - least) / 2 : 0));
  bool stuck = false;
  double tighten_at = kTightenEvery * kReferenceFaces;
  for (const std::size_t i : order) {
    while (!stuck && collapser.face_count() > faces[i]) {
      if (tighten && !collapser.keeps_enclosed() && collapser.face_count() <= kReferenceFaces) collapser.KeepEnclosed();
      if (collapser.keeps_enclosed() && static_cast<double>(collapser.face_count()) <= tighten_at) {
        if (collapser.face_count() <= kAroundEnclosedFaces) collapser.HoldByEnclosedAlone();
        collapser.Tighten(kTightenSweeps);
        tighten_at = kTightenEvery * static_cast<double>(collapser.face_count());
        if (!collapser.StillEncloses()) return std::nullopt;
      }
      stuck = !collapser.Step();
      if (stuck) break;
      ++s.collapses;
      if (s.collapses % 256 == 0) steps.Step(256);
    }
    if (collapser.keeps_enclosed() && s.collapses > 0) {
      collapser.Tighten(2 * kTightenSweeps);
      if (!collapser.StillEncloses()) return std::nullopt;
    }
    hulls[i] = {collapser.Result(), watch.Seconds(), collapser.face_count() <= faces[i]};
  }
  s.programs = collapser.programs();
  s.evaluate_s = collapser.evaluate_s();
  return hulls;
}

}  // namespace

std::vector<KeptHull> KeepHull(const Mesh& mesh, const std::vector<std::size_t>& faces, ProgressSink& progress,
                               ProgressiveHullSummary* summary) {
  const Stopwatch watch;
  if (!IsClosed(mesh))
    throw DataError("the mesh is open: only a closed one has an inside to keep", "simplify it without --keep-hull");
  ProgressiveHullSummary s;
  s.volume_before = EnclosedVolume(mesh);
  if (!(s.volume_before > 0))
    throw DataError("the mesh is inside out or encloses nothing: there is no hull to keep",
                    "simplify it without --keep-hull, or turn its faces over");
  auto hulls = TryToKeepHull(mesh, faces, true, progress, s);
  if (!hulls) {
    // By the planes of the faces alone, which cannot fail, and is not as tight.
    s.fell_back = true;
    const double lost = watch.Seconds();
    hulls = TryToKeepHull(mesh, faces, false, progress, s);
    for (KeptHull& hull : *hulls) hull.seconds += lost;
  }
  if (summary != nullptr) *summary = s;
  return *std::move(hulls);
}

}  // namespace lumi
