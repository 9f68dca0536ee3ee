#include "proxy/hull/visual_hull.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "scene/geometry/disjoint_sets.h"
#include "proxy/hull/consistency.h"
#include "proxy/hull/contour.h"
#include "proxy/hull/hull_grid.h"
#include "proxy/hull/mending.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

constexpr double kStartHalf = 2.5;  // half of the box that hulls are looked for in, in distances of the farthest camera
constexpr double kDilationStep = 0.25;      // pixels, where a measured hull falls short
constexpr double kContourReserve = 1;       // pixels of dilation beyond the largest allowed, for what the grid takes
constexpr double kMostUncovered = 0.5;      // of a silhouette, by all others: of another object
constexpr double kRoughlyUncovered = 0.05;  // of a silhouette: a view that leaves or takes more is off altogether
constexpr double kSettlingCellPx = 4;       // of the hulls that show where silhouettes disagree
constexpr int kMostSettlings = 8;
constexpr double kSpeck = 1e-3;  // of the largest part's volume
constexpr int kMostHalvings = 3;
constexpr double kLeastCoarser = 1.1, kMostCoarser = 2;  // steps of a grid that has too many cubes
constexpr int kMostRepeats = 16;
constexpr std::size_t kMostViews = 65535;
constexpr std::size_t kMostNamed = 5;  // views, in a refusal
constexpr const char* kWhatToTry =
    "look at those masks; lumi-proxy silhouettes makes others (--rule, --background, --box, --masks ...), and "
    "--silhouettes names their folder";

Eigen::Vector2d CentroidOf(const Image8& mask) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double n = 0;
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.At(x, y, 0) < 128) continue;
      sum += Eigen::Vector2d(x + 0.5, y + 0.5);
      ++n;
    }
  }
  return sum / n;
}

// Where the rays through the silhouettes' centroids come closest becomes the origin, the distance of the farthest
// camera from there the unit.
void FindObject(const std::optional<Eigen::Vector3d>& near, Carving& carving) {
  const std::vector<SilhouetteView>& views = carving.views;
  std::vector<Eigen::Vector3d> eyes;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const SilhouetteView& view : views) {
    const Eigen::Vector4d c = CentreOfProjection(view.P);
    if (!c.allFinite() || !(std::abs(c.w()) > 0))
      throw DataError("view " + view.name + " has no centre of projection", "hulls need cameras at finite places");
    eyes.push_back(c.head<3>() / c.w());
    mean += eyes.back() / static_cast<double>(views.size());
  }
  double spread = 0;
  for (const Eigen::Vector3d& e : eyes) spread = std::max(spread, (e - mean).norm());
  const auto in_front = [&](const Eigen::Vector3d& x) {
    std::size_t front = 0;
    for (std::size_t n = 0; n < views.size(); ++n) {
      const auto axis = views[n].P.block<1, 3>(2, 0);
      // A thousandth of the way is not before a camera: the rays do not say where they meet.
      if (axis.dot((x - eyes[n]).transpose()) > 1e-3 * axis.norm() * std::max(spread, (x - eyes[n]).norm())) ++front;
    }
    return 2 * front > views.size();
  };
  bool found = false;
  if (spread > 0) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (std::size_t n = 0; n < views.size(); ++n) {
      const auto direction = RayDirection(views[n].P, CentroidOf(views[n].mask));
      if (!direction) throw DataError("view " + views[n].name + " has a singular camera");
      const Eigen::Vector3d d = direction->normalized();
      const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
      A += across;
      b += across * ((eyes[n] - mean) / spread);
    }
    const Eigen::Vector3d x = SolveLeastNorm(A, b);
    carving.origin = mean + spread * x;
    found = x.allFinite() && in_front(carving.origin);
  }
  if (!found && near && in_front(*near)) {
    carving.origin = *near;
    found = true;
  }
  if (!found)
    throw DataError("the views do not say where the object is: they look from one place or along one line",
                    "add photos from other sides, or points to the scene");
  carving.unit = 0;
  for (const Eigen::Vector3d& e : eyes) carving.unit = std::max(carving.unit, (e - carving.origin).norm());
}

// The parts of more than `share` of the largest part's volume. 0: all but enclosed pockets, whose faces look inwards,
// where no camera is; only sampled hulls have any.
Mesh KeepParts(const Mesh& mesh, double share) {
  DisjointSets parts(mesh.vertices.size());
  for (const auto& f : mesh.faces)
    for (std::size_t k = 1; k < 3; ++k) parts.Join(static_cast<std::size_t>(f[k]), static_cast<std::size_t>(f[0]));
  const auto part_of = [&](const std::array<std::int32_t, 3>& f) { return parts.Find(static_cast<std::size_t>(f[0])); };
  std::vector<double> volume(mesh.vertices.size(), 0);
  for (const auto& f : mesh.faces) {
    const std::size_t part = part_of(f);
    const auto corner = [&](std::size_t k) {
      return Eigen::Vector3d(mesh.vertices[static_cast<std::size_t>(f[k])] - mesh.vertices[part]);
    };
    volume[part] += corner(0).dot(corner(1).cross(corner(2)));
  }
  const double least = volume.empty() ? 0 : share * *std::ranges::max_element(volume);
  std::vector<std::int32_t> number(mesh.vertices.size(), -1);
  Mesh kept;
  for (const auto& f : mesh.faces) {
    if (!(volume[part_of(f)] > least)) continue;
    std::array<std::int32_t, 3> face;
    for (std::size_t k = 0; k < 3; ++k) {
      std::int32_t& n = number[static_cast<std::size_t>(f[k])];
      if (n < 0) {
        n = static_cast<std::int32_t>(kept.vertices.size());
        kept.vertices.push_back(mesh.vertices[static_cast<std::size_t>(f[k])]);
      }
      face[k] = n;
    }
    kept.faces.push_back(face);
  }
  return kept;
}

struct Contoured {
  Mesh mesh;  // in the work frame
  double cell = 0, cell_px = 0;
  bool bounded = true;
};

// go_on: asked between grids.
std::optional<Contoured> ContourHull(const std::vector<const SilhouetteCone*>& cones, const Box& start,
                                     double dilation_px, const HullOptions& options,
                                     const std::function<void()>& go_on) {
  const auto box = BoundHull(cones, start, dilation_px, 0);
  if (!box) return std::nullopt;
  Contoured result;
  result.bounded = (box->low - start.low).minCoeff() > 0 && (start.high - box->high).minCoeff() > 0;
  const Eigen::Vector3d middle = 0.5 * (box->low + box->high), extent = box->high - box->low;
  double finest = 0;
  for (const SilhouetteCone* c : cones) finest = std::max(finest, c->PixelsPerUnit(middle));
  if (!(finest > 0)) return std::nullopt;
  const bool all_cut = std::ranges::all_of(cones, [](const SilhouetteCone* c) { return c->IsCut(); });
  const auto dilation = static_cast<float>(dilation_px);
  std::optional<SurfaceCubes> surface;
  const Solid solid = [&](const Eigen::Vector3d& x, std::int32_t cube) {
    float most = -SilhouetteCone::kBehind;
    if (cube >= 0)
      for (const std::uint16_t c : surface->cones[static_cast<std::size_t>(cube)])
        most = std::max(most, cones[c]->Distance(x));
    else
      for (const SilhouetteCone* c : cones) most = std::max(most, c->Distance(x));
    if (all_cut) {  // each silhouette touches its image's side: points in no view's frame count as outside
      float frame = SilhouetteCone::kBehind;
      for (const SilhouetteCone* c : cones) frame = std::min(frame, c->FrameDistance(x));
      most = std::max(most, frame);
    }
    return most - dilation;
  };
  double cell = std::min(options.cell_px / finest, extent.maxCoeff() / options.min_cells);
  cell = std::max(cell, extent.maxCoeff() / (GridFrame::kMaxCells - 8));
  int finer = 0;
  for (int attempt = 0; attempt < 40 && finer <= kMostHalvings; ++attempt) {
    GridFrame grid;
    grid.cell = cell;
    grid.origin = box->low - Eigen::Vector3d::Constant(2 * cell);
    for (int a = 0; a < 3; ++a)
      grid.cells[static_cast<std::size_t>(a)] = static_cast<int>(std::ceil(extent[a] / cell)) + 4;
    go_on();
    double too_many = 1;
    surface = FindSurfaceCubes(cones, grid, dilation_px, options.max_cubes, &too_many);
    if (!surface) {
      cell *= std::clamp(std::sqrt(too_many), kLeastCoarser, kMostCoarser);
      continue;
    }
    if (surface->cubes.empty()) return std::nullopt;
    result.cell = cell;
    result.cell_px = cell * finest;
    result.mesh = KeepParts(Contour(grid, surface->cubes, solid), 0);
    if (!result.mesh.faces.empty()) return result;
    cell *= 0.5;  // all of it, if there is any, fell between the grid's corners
    ++finer;
  }
  return std::nullopt;
}

// Where the object may be, before it is known which views are wrong. Up to a fifth of the views may carve it away;
// where that leaves nothing, more may.
Box RoughBox(const std::vector<SilhouetteCone>& cones, const Box& start, double dilation_px) {
  std::vector<const SilhouetteCone*> all;
  for (const SilhouetteCone& c : cones) all.push_back(&c);
  const int n = static_cast<int>(cones.size());
  for (int misses = n >= 3 ? std::max(1, n / 5) : 0; misses <= std::max(0, n - 2); misses = 2 * misses + 1)
    if (const auto box = BoundHull(all, start, dilation_px, misses)) return *box;
  throw DataError("the silhouettes agree nowhere: no point of space lies in two of them",
                  "check the cameras and that masks and photos belong together");
}

bool IsCovered(const SilhouetteFit& fit, const HullOptions& options) {
  return fit.coverage >= options.min_coverage && fit.deepest_uncovered_px <= options.max_uncovered_depth_px;
}

// One hull, from silhouettes that may not agree to a mesh.
class HullMaker {
 public:
  HullMaker(const HullOptions& options, ProgressSink& progress) : options_(options), progress_(progress) {
    // A tight hull asks which views are off altogether, whatever its own dilation.
    agree_.max_dilation_px = tight() ? options.max_dilation_px : options.dilation_px.value_or(options.max_dilation_px);
    agree_.max_uncovered = 1 - options.min_coverage;
    agree_.max_uncovered_depth_px = options.max_uncovered_depth_px;
    agree_.go_on = [this] { RequireTime(); };
    settled_ = !judges() || tight() || !(options.max_mended > 0);
  }

  Mesh Make(const std::vector<SilhouetteView>& views, const std::optional<Eigen::Vector3d>& near) {
    const auto start = std::chrono::steady_clock::now();
    s.tight = tight();
    TakeUsable(views, near);
    if (judges()) Judge();
    s.agreement_s = SecondsSince(start);
    if (!needed_.enough) SettleOnce();
    if (tight() && !options_.dilation_px) FindTightDilation();
    Mesh mesh = tight() ? ContourOnce() : ContourUntilCovered();
    TellViews();
    DropSpecks(mesh);
    s.dilation_px = dilation_;
    s.fit = Summarize(s.fits);
    s.volume = EnclosedVolume(mesh);
    if (!s.bounded) progress_.Message("the views leave the object open to some side: the hull is cut off there");
    return mesh;
  }

  HullSummary s;

 private:
  bool tight() const { return options_.prefer == HullPreference::kTight; }
  bool judges() const { return !(options_.keep_all_views && (options_.dilation_px || tight())); }
  std::vector<std::size_t>& used() { return carving_.agreement.used; }

  // Those that say something, and where the object is.
  void TakeUsable(const std::vector<SilhouetteView>& views, const std::optional<Eigen::Vector3d>& near) {
    for (const SilhouetteView& view : views) {
      if (view.mask.empty() || view.mask.channels != 1)
        throw DataError("view " + view.name + " has no silhouette of one channel");
      if (!view.P.allFinite()) throw DataError("the camera of view " + view.name + " is not finite");
      const std::size_t object = CountObject(view.mask);
      if (object == 0)
        s.left_out.push_back({view.name, "its silhouette is empty"});
      else if (object == view.mask.data.size())
        s.left_out.push_back({view.name, "its silhouette fills the image: it carves nothing"});
      else
        carving_.views.push_back(view);
    }
    const std::size_t n = carving_.views.size();
    if (n > kMostViews) throw DataError(fmt::format("{} silhouettes; a hull takes {} at most", n, kMostViews));
    if (n < 2)
      throw DataError(fmt::format("{} of {} silhouettes can be used; a hull needs two", n, views.size()),
                      s.left_out.empty() ? "add photos from other sides"
                                         : "look at " + s.left_out.front().name + ": " + s.left_out.front().reason);
    FindObject(near, carving_);
    for (const SilhouetteView& view : carving_.views) carving_.cones.emplace_back(view, carving_.origin, carving_.unit);
    carving_.mends.resize(n);
    used().resize(n);
    std::iota(used().begin(), used().end(), std::size_t{0});
    if (!options_.keep_all_views)
      agree_.fewest_used = std::max<std::size_t>(
          2, static_cast<std::size_t>(std::ceil((1 - options_.max_left_out) * static_cast<double>(n) - 1e-9)));
  }

  // Of a share of silhouettes' pixels, the three worst: "view7 (12.5 %), ...".
  std::string Worst(std::vector<std::pair<double, std::size_t>> shares) const {
    std::ranges::stable_sort(shares, std::greater<>(), [](const auto& of_view) { return of_view.first; });
    shares.resize(std::min(shares.size(), kMostNamed));
    std::string text;
    for (const auto& [share, view] : shares)
      text += fmt::format("{}{} ({:.1f} %)", text.empty() ? "" : ", ", carving_.views[view].name, 100 * share);
    return text;
  }

  // What to look at: what views take from others and show alone, of those left out, else what the last hull leaves
  // uncovered.
  std::string WorstViews() const {
    std::vector<std::pair<double, std::size_t>> shares;
    for (const Disagreement& d : carving_.agreement.left_out)
      shares.emplace_back(std::max(d.blame, d.uncovered), d.view);
    for (const auto& [view, uncovered] : uncovered_)
      if (std::ranges::none_of(shares, [&](const auto& known) { return known.second == view; }))
        shares.emplace_back(uncovered, view);
    return shares.empty() ? "none was compared yet" : Worst(std::move(shares));
  }

  void RequireMostAgree() const {
    const std::size_t n = carving_.views.size(), left = carving_.agreement.used.size();
    if (options_.keep_all_views || left >= agree_.fewest_used) return;
    throw DataError(
        fmt::format(
            "the silhouettes disagree in most views: {} of {} would have to be left out; most: {} of a silhouette",
            n - left, n, WorstViews()),
        fmt::format("{}; --max-left-out 1 takes the hull of those that agree, however few", kWhatToTry));
  }

  void RequireTime() const {
    if (!(options_.max_minutes > 0) || clock_.Seconds() <= 60 * options_.max_minutes) return;
    throw DataError(
        fmt::format("no hull of these {} silhouettes within {:g} minutes ({} coarse and {} fine ones were "
                    "built); they disagree most in {} of a silhouette",
                    carving_.views.size(), options_.max_minutes, s.coarse_hulls, s.fine_hulls, WorstViews()),
        fmt::format("{}; a coarser --cell-px, --prefer tight or more --max-minutes", kWhatToTry));
  }

  std::optional<Contoured> Hull(double dilation_px, const HullOptions& options, int& count) {
    RequireTime();
    auto hull = ContourHull(Active(), start_, dilation_px, options, agree_.go_on);
    ++count;
    return hull;
  }
  HullOptions Coarse() const {
    HullOptions coarse = options_;
    coarse.cell_px = std::max(options_.cell_px, kSettlingCellPx);
    return coarse;
  }
  void Remember(const std::vector<SilhouetteFit>& fits) {
    uncovered_.clear();
    for (std::size_t n = 0; n < fits.size(); ++n) uncovered_.emplace_back(used()[n], 1 - fits[n].coverage);
  }

  // Who agrees with whom, and at what dilation.
  void Judge() {
    std::vector<SilhouetteCone>& cones = carving_.cones;
    const std::vector<std::size_t> all = used();
    caster_.emplace(carving_.views, cones, RoughBox(cones, start_, agree_.max_dilation_px), carving_.origin,
                    carving_.unit);
    const int count = std::clamp(options_.max_rays / static_cast<int>(cones.size()), 200, options_.rays_per_view);
    rays_.resize(cones.size());
    ParallelEach(cones.size(), 1, [&](std::size_t v) { rays_[v] = caster_->Sample(v, count); });
    // What is off altogether goes first; what a silhouette lacks in places is mended afterwards.
    AgreementOptions rough = agree_;
    if (tight() || options_.max_mended > 0) {
      rough.max_uncovered = std::max(agree_.max_uncovered, kRoughlyUncovered);
      rough.max_uncovered_depth_px = std::numeric_limits<double>::infinity();
    }
    carving_.agreement = FindAgreement(rays_, cones, rough, progress_);
    if (carving_.agreement.uncovered > kMostUncovered)
      throw DataError("the silhouettes agree nowhere: no two of them can be of one object",
                      "check the cameras and that masks and photos belong together");
    RequireMostAgree();
    if (options_.keep_all_views) {
      used() = all;
      carving_.agreement.left_out.clear();
    }
    if (tight()) return;
    needed_ = FindDilation(rays_, cones, used(), agree_, progress_);
  }

  // Hulls of silhouettes as far apart as is allowed, coarse, show where they disagree. False: it is done already.
  bool SettleOnce() {
    if (std::exchange(settled_, true)) return false;
    const auto from = std::chrono::steady_clock::now();
    MendOptions mend;
    mend.agreement = agree_;
    mend.max_mended = options_.max_mended;
    mend.leave_out = !options_.keep_all_views;
    for (int round = 0; round < kMostSettlings; ++round) {
      const auto contoured = Hull(agree_.max_dilation_px, Coarse(), s.coarse_hulls);
      if (!contoured) break;
      std::vector<std::vector<UncoveredPixel>> uncovered;
      Remember(MeasureSilhouettes(InWorld(contoured->mesh), Shown(), &uncovered));
      if (!SettleConflicts(uncovered, *caster_, mend, carving_, progress_)) break;
      RequireMostAgree();
      s.settlings = round + 1;
    }
    needed_ = FindDilation(rays_, carving_.cones, used(), agree_, progress_);
    s.mend_s += SecondsSince(from);
    return true;
  }

  // The one of the largest IoU, to an eighth of the largest that is allowed: halfway points around the best so far.
  void FindTightDilation() {
    constexpr int kSteps = 8;
    std::map<int, double> iou;  // by the dilation in eighths
    const auto try_at = [&](int step) {
      if (step < 0 || step > kSteps || iou.contains(step)) return;
      const auto contoured = Hull(agree_.max_dilation_px * step / kSteps, Coarse(), s.coarse_hulls);
      if (!contoured) return;
      const std::vector<SilhouetteFit> fits = MeasureSilhouettes(InWorld(contoured->mesh), Shown());
      Remember(fits);
      iou[step] = Summarize(fits).iou_median;
    };
    int best = 0;
    for (const int step : {0, kSteps / 2, kSteps}) try_at(step);
    for (int half = kSteps / 4; half > 0; half /= 2) {
      best = Best(iou);
      try_at(best - half);
      try_at(best + half);
    }
    best = Best(iou);
    dilation_ = agree_.max_dilation_px * best / kSteps;
  }
  // Of equal ones the least dilation.
  static int Best(const std::map<int, double>& iou) {
    const auto best = std::ranges::max_element(iou, {}, [](const auto& p) { return p.second; });
    return best == iou.end() ? 0 : best->first;
  }

  // The hull at the dilation that was found or given, whatever it covers.
  Mesh ContourOnce() {
    if (options_.dilation_px) dilation_ = *options_.dilation_px;
    Stopwatch watch;
    const auto contoured = Hull(dilation_, options_, s.fine_hulls);
    s.contour_s += watch.Lap();
    if (!contoured) throw EmptyHull();
    return Measured(*contoured);
  }

  double FirstDilation() const { return options_.dilation_px.value_or(std::max(kLeastDilation, needed_.px)); }

  // Dilates, settles or leaves a view out until the hull covers every silhouette that is used.
  Mesh ContourUntilCovered() {
    dilation_ = FirstDilation();
    Progress steps(progress_, "visual hull", 0);
    for (int repeat = 0;; ++repeat) {
      Stopwatch watch;
      const auto contoured = Hull(dilation_, options_, s.fine_hulls);
      s.contour_s += watch.Lap();
      const double reserve =
          options_.dilation_px ? 0 : std::max(options_.max_dilation_px, kLeastDilation) + kContourReserve - dilation_;
      if (!contoured) {
        if (reserve < kDilationStep || repeat >= kMostRepeats) throw EmptyHull();
        dilation_ += kDilationStep;
        continue;
      }
      Mesh mesh = Measured(*contoured);
      steps.Step();
      const std::optional<std::size_t> worst = WorstCovered();
      if (!worst || repeat >= kMostRepeats) return mesh;
      if (dilation_ >= agree_.max_dilation_px && SettleOnce()) {
        dilation_ = FirstDilation();
      } else if (reserve >= kDilationStep) {
        dilation_ += kDilationStep;
      } else if (!options_.keep_all_views && used().size() > 2) {
        s.left_out.push_back(
            {carving_.views[used()[*worst]].name,
             fmt::format(
                 "the others' hull covers {:.2f} % of its silhouette, and misses a pixel {:.1f} px from its border",
                 100 * s.fits[*worst].coverage, s.fits[*worst].deepest_uncovered_px)});
        used().erase(used().begin() + static_cast<std::ptrdiff_t>(*worst));
        RequireMostAgree();
      } else {
        return mesh;
      }
    }
  }

  Mesh Measured(const Contoured& contoured) {
    Mesh mesh = InWorld(contoured.mesh);
    s.cell = contoured.cell * carving_.unit;
    s.cell_px = contoured.cell_px;
    s.bounded = contoured.bounded;
    Stopwatch watch;
    s.fits = MeasureSilhouettes(mesh, Shown());
    Remember(s.fits);
    s.measure_s += watch.Lap();
    return mesh;
  }

  static DataError EmptyHull() {
    return DataError("the silhouettes agree nowhere: their hull is empty",
                     "check the cameras and that masks and photos belong together");
  }

  // Of the used views, by position; none: each is covered.
  std::optional<std::size_t> WorstCovered() const {
    std::optional<std::size_t> worst;
    for (std::size_t n = 0; n < s.fits.size(); ++n)
      if (!IsCovered(s.fits[n], options_) && (!worst || s.fits[n].coverage < s.fits[*worst].coverage)) worst = n;
    return worst;
  }

  void TellViews() {
    for (const Disagreement& d : carving_.agreement.left_out)
      s.left_out.push_back({carving_.views[d.view].name,
                            fmt::format("does not agree with the others: takes {:.1f} % of a silhouette from them, "
                                        "{:.1f} % of its own is covered by none",
                                        100 * d.blame, 100 * d.uncovered)});
    for (const std::size_t v : used()) {
      const SilhouetteView& view = carving_.views[v];
      s.used.push_back(view.name);
      if (carving_.mends[v].empty()) continue;
      const auto before = static_cast<double>(CountObject(view.mask)),
                 after = static_cast<double>(CountObject(Mended(view.mask, carving_.mends[v])));
      if (after > before) s.mended.push_back({view.name, after / before - 1});
    }
  }

  // Specks where cones happen to meet beside the object: gone, if no pixel of a silhouette misses them.
  void DropSpecks(Mesh& mesh) {
    Mesh large = KeepParts(mesh, kSpeck);
    if (large.faces.size() >= mesh.faces.size()) return;
    std::vector<SilhouetteFit> fits = MeasureSilhouettes(large, Shown());
    for (std::size_t n = 0; n < fits.size(); ++n)
      if (fits[n].coverage < s.fits[n].coverage) return;
    mesh = std::move(large);
    s.fits = std::move(fits);
  }

  std::vector<const SilhouetteCone*> Active() {
    std::vector<const SilhouetteCone*> list;
    for (const std::size_t v : used()) list.push_back(&carving_.cones[v]);
    return list;
  }
  std::vector<SilhouetteView> Shown() {
    std::vector<SilhouetteView> list;
    for (const std::size_t v : used()) list.push_back(carving_.views[v]);
    return list;
  }
  Mesh InWorld(Mesh mesh) const {
    for (Eigen::Vector3d& x : mesh.vertices) x = carving_.origin + carving_.unit * x;
    return mesh;
  }

  const HullOptions& options_;
  ProgressSink& progress_;
  const Box start_{Eigen::Vector3d::Constant(-kStartHalf), Eigen::Vector3d::Constant(kStartHalf)};
  AgreementOptions agree_;
  Carving carving_;
  std::optional<RayCaster> caster_;
  std::vector<std::vector<AgreementRay>> rays_;
  NeededDilation needed_;
  bool settled_ = false;
  double dilation_ = 0;
  std::vector<std::pair<std::size_t, double>> uncovered_;  // of the last hull: views, shares of their silhouettes
  const Stopwatch clock_;
};

}  // namespace

std::string Validate(const HullOptions& o) {
  if (!(o.cell_px > 0) || !(o.cell_px <= 1000)) return "the grid's cell must be above 0 and at most 1000 pixels";
  if (o.dilation_px && (!(*o.dilation_px >= 0) || !(*o.dilation_px <= 40)))
    return "the dilation must be between 0 and 40 pixels";
  if (!(o.max_dilation_px >= 0) || !(o.max_dilation_px <= 40))
    return "the largest dilation must be between 0 and 40 pixels";
  if (!(o.max_left_out >= 0) || !(o.max_left_out <= 1)) return "the share of views left out must be between 0 and 1";
  if (!(o.max_minutes >= 0)) return "the minutes after which a hull is given up must be 0 (never) or more";
  if (!(o.max_mended >= 0) || !(o.max_mended <= 1)) return "what may be mended of a silhouette must be between 0 and 1";
  if (!(o.min_cells >= 4) || !(o.min_cells <= 1e4)) return "the least number of cells must be between 4 and 10000";
  return {};
}

Mesh BuildVisualHull(const std::vector<SilhouetteView>& views, const HullOptions& options, ProgressSink& progress,
                     HullSummary* summary, const std::optional<Eigen::Vector3d>& near) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  HullMaker maker(options, progress);
  const auto tell = [&] {
    if (summary != nullptr) *summary = std::move(maker.s);
  };
  try {
    Mesh mesh = maker.Make(views, near);
    tell();
    return mesh;
  } catch (const DataError&) {
    tell();
    throw;
  }
}

}  // namespace lumi
