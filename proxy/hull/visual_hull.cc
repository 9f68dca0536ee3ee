#include "proxy/hull/visual_hull.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include "proxy/hull/consistency.h"
#include "proxy/hull/contour.h"
#include "proxy/hull/hull_grid.h"
#include "proxy/hull/mending.h"
#include "scene/geometry/dense_solvers.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

constexpr double kStartHalf = 2.5;  // half of the box that hulls are looked for in, in distances of the farthest camera
constexpr double kLeastDilation = 0.5;      // pixels: what a silhouette of whole pixels does not know of its border
constexpr double kDilationStep = 0.25;      // pixels, where a measured hull falls short
constexpr double kContourReserve = 1;       // pixels of dilation beyond the largest allowed, for what the grid takes
constexpr double kMostUncovered = 0.5;      // of a silhouette, by all others: of another object
constexpr double kRoughlyUncovered = 0.05;  // of a silhouette: a view that leaves or takes more is off altogether
constexpr double kSettlingCellPx = 4;       // of the hulls that show where silhouettes disagree
constexpr int kMostSettlings = 8;
constexpr double kSpeck = 1e-3;  // of the largest part's volume
constexpr int kMostHalvings = 3;
constexpr int kMostRepeats = 16;
constexpr std::size_t kMostViews = 65535;

struct WorkFrame {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double unit = 1;
};

std::size_t CountObject(const Image8& mask) {
  return static_cast<std::size_t>(
      std::count_if(mask.data.begin(), mask.data.end(), [](std::uint8_t m) { return m >= 128; }));
}

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

// Where the rays through the silhouettes' centroids come closest, and the distance of the farthest camera from there.
WorkFrame FindObject(const std::vector<SilhouetteView>& views, const std::vector<std::size_t>& usable,
                     const std::optional<Eigen::Vector3d>& near) {
  std::vector<Eigen::Vector3d> eyes;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::size_t v : usable) {
    const Eigen::Vector4d c = CentreOfProjection(views[v].P);
    if (!c.allFinite() || !(std::abs(c.w()) > 0))
      throw DataError("view " + views[v].name + " has no centre of projection", "hulls need cameras at finite places");
    eyes.push_back(c.head<3>() / c.w());
    mean += eyes.back() / static_cast<double>(usable.size());
  }
  double spread = 0;
  for (const Eigen::Vector3d& e : eyes) spread = std::max(spread, (e - mean).norm());
  WorkFrame frame;
  const auto in_front = [&](const Eigen::Vector3d& x) {
    std::size_t front = 0;
    for (std::size_t n = 0; n < usable.size(); ++n) {
      const auto axis = views[usable[n]].P.block<1, 3>(2, 0);
      // A thousandth of the way is not before a camera: the rays do not say where they meet.
      if (axis.dot((x - eyes[n]).transpose()) > 1e-3 * axis.norm() * std::max(spread, (x - eyes[n]).norm())) ++front;
    }
    return 2 * front > usable.size();
  };
  bool found = false;
  if (spread > 0) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (std::size_t n = 0; n < usable.size(); ++n) {
      const auto direction = RayDirection(views[usable[n]].P, CentroidOf(views[usable[n]].mask));
      if (!direction) throw DataError("view " + views[usable[n]].name + " has a singular camera");
      const Eigen::Vector3d d = direction->normalized();
      const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
      A += across;
      b += across * ((eyes[n] - mean) / spread);
    }
    const Eigen::Vector3d x = SolveLeastNorm(A, b);
    frame.origin = mean + spread * x;
    found = x.allFinite() && in_front(frame.origin);
  }
  if (!found && near && in_front(*near)) {
    frame.origin = *near;
    found = true;
  }
  if (!found) {
    throw DataError("the views do not say where the object is: they look from one place or along one line",
                    "add photos from other sides, or points to the scene");
  }
  frame.unit = 0;
  for (const Eigen::Vector3d& e : eyes) frame.unit = std::max(frame.unit, (e - frame.origin).norm());
  return frame;
}

// The parts of more than `share` of the largest part's volume. 0: all but enclosed pockets, whose faces look inwards,
// to nowhere that a camera is; only a sampled hull has any.
Mesh KeepParts(const Mesh& mesh, double share) {
  std::vector<std::int32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](std::int32_t v) {
    while (parent[static_cast<std::size_t>(v)] != v) {
      auto& p = parent[static_cast<std::size_t>(v)];
      p = parent[static_cast<std::size_t>(p)];
      v = p;
    }
    return v;
  };
  for (const auto& f : mesh.faces) {
    for (std::size_t k = 1; k < 3; ++k) parent[static_cast<std::size_t>(root(f[k]))] = root(f[0]);
  }
  std::vector<double> volume(mesh.vertices.size(), 0);
  for (const auto& f : mesh.faces) {
    const std::int32_t r = root(f[0]);
    const Eigen::Vector3d& o = mesh.vertices[static_cast<std::size_t>(r)];
    volume[static_cast<std::size_t>(r)] += (mesh.vertices[static_cast<std::size_t>(f[0])] - o)
                                               .dot((mesh.vertices[static_cast<std::size_t>(f[1])] - o)
                                                        .cross(mesh.vertices[static_cast<std::size_t>(f[2])] - o));
  }
  const double least = volume.empty() ? 0 : share * *std::max_element(volume.begin(), volume.end());
  std::vector<std::int32_t> number(mesh.vertices.size(), -1);
  Mesh kept;
  for (const auto& f : mesh.faces) {
    if (!(volume[static_cast<std::size_t>(root(f[0]))] > least)) continue;
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

std::optional<Contoured> ContourHull(const std::vector<const SilhouetteCone*>& cones, const Box& start,
                                     double dilation_px, const HullOptions& options) {
  const auto box = BoundHull(cones, start, dilation_px, 0);
  if (!box) return std::nullopt;
  Contoured result;
  result.bounded = (box->low - start.low).minCoeff() > 0 && (start.high - box->high).minCoeff() > 0;
  const Eigen::Vector3d middle = 0.5 * (box->low + box->high), extent = box->high - box->low;
  double finest = 0;
  for (const SilhouetteCone* c : cones) finest = std::max(finest, c->PixelsPerUnit(middle));
  if (!(finest > 0)) return std::nullopt;
  const bool all_cut = std::all_of(cones.begin(), cones.end(), [](const SilhouetteCone* c) { return c->IsCut(); });
  const auto dilation = static_cast<float>(dilation_px);
  std::optional<SurfaceCubes> surface;
  const Solid solid = [&](const Eigen::Vector3d& x, std::int32_t cube) {
    float most = -SilhouetteCone::kBehind;
    if (cube >= 0) {
      for (const std::uint16_t c : surface->cones[static_cast<std::size_t>(cube)])
        most = std::max(most, cones[c]->Distance(x));
    } else {
      for (const SilhouetteCone* c : cones) most = std::max(most, c->Distance(x));
    }
    if (all_cut) {  // what is in no view's frame is no view's business
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
    surface = FindSurfaceCubes(cones, grid, dilation_px, options.max_cubes);
    if (!surface) {
      cell *= 1.26;
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

Mesh InWorld(Mesh mesh, const WorkFrame& frame) {
  for (Eigen::Vector3d& x : mesh.vertices) x = frame.origin + frame.unit * x;
  return mesh;
}

// Where the object may be, before it is known who is wrong. A fifth of the views may be and still not hide it; with
// more wrong, more.
Box RoughBox(const std::vector<SilhouetteCone>& cones, const Box& start, double dilation_px) {
  std::vector<const SilhouetteCone*> all;
  for (const SilhouetteCone& c : cones) all.push_back(&c);
  const int n = static_cast<int>(cones.size());
  for (int misses = n >= 3 ? std::max(1, n / 5) : 0; misses <= std::max(0, n - 2); misses = 2 * misses + 1) {
    if (const auto box = BoundHull(all, start, dilation_px, misses)) return *box;
  }
  throw DataError("the silhouettes agree nowhere: no point of space lies in two of them",
                  "check the cameras and that masks and photos belong together");
}

bool IsCovered(const SilhouetteFit& fit, const HullOptions& options) {
  return fit.coverage >= options.min_coverage && fit.deepest_uncovered_px <= options.max_uncovered_depth_px;
}

}  // namespace

std::string Validate(const HullOptions& o) {
  if (!(o.cell_px > 0) || !(o.cell_px <= 1000)) return "the grid's cell must be above 0 and at most 1000 pixels";
  if (o.dilation_px && (!(*o.dilation_px >= 0) || !(*o.dilation_px <= 40)))
    return "the dilation must be between 0 and 40 pixels";
  if (!(o.max_dilation_px >= 0) || !(o.max_dilation_px <= 40))
    return "the largest dilation must be between 0 and 40 pixels";
  if (!(o.max_mended >= 0) || !(o.max_mended <= 1)) return "what may be mended of a silhouette must be between 0 and 1";
  if (!(o.min_cells >= 4) || !(o.min_cells <= 1e4)) return "the least number of cells must be between 4 and 10000";
  return {};
}

Mesh BuildVisualHull(const std::vector<SilhouetteView>& views, const HullOptions& options, ProgressSink& progress,
                     HullSummary* summary, const std::optional<Eigen::Vector3d>& near) {
  if (const std::string wrong = Validate(options); !wrong.empty()) throw UsageError(wrong);
  HullSummary s;
  std::vector<std::size_t> usable;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Image8& mask = views[v].mask;
    if (mask.empty() || mask.channels != 1)
      throw DataError("view " + views[v].name + " has no silhouette of one channel");
    if (!views[v].P.allFinite()) throw DataError("the camera of view " + views[v].name + " is not finite");
    const std::size_t object = CountObject(mask);
    if (object == 0) {
      s.left_out.push_back({views[v].name, "its silhouette is empty"});
    } else if (object == mask.data.size()) {
      s.left_out.push_back({views[v].name, "its silhouette fills the image: it carves nothing"});
    } else {
      usable.push_back(v);
    }
  }
  if (usable.size() > kMostViews)
    throw DataError(fmt::format("{} silhouettes; a hull takes {} at most", usable.size(), kMostViews));
  if (usable.size() < 2) {
    throw DataError(fmt::format("{} of {} silhouettes can be used; a hull needs two", usable.size(), views.size()),
                    s.left_out.empty() ? "add photos from other sides"
                                       : "look at " + s.left_out.front().name + ": " + s.left_out.front().reason);
  }

  auto start_time = std::chrono::steady_clock::now();
  const WorkFrame frame = FindObject(views, usable, near);
  std::vector<SilhouetteView> chosen;
  std::vector<SilhouetteCone> cones;
  for (const std::size_t v : usable) {
    chosen.push_back(views[v]);
    cones.emplace_back(views[v], frame.origin, frame.unit);
  }
  const Box start{Eigen::Vector3d::Constant(-kStartHalf), Eigen::Vector3d::Constant(kStartHalf)};

  AgreementOptions agree;
  agree.max_dilation_px = options.dilation_px.value_or(options.max_dilation_px);
  agree.max_uncovered = 1 - options.min_coverage;
  agree.max_uncovered_depth_px = options.max_uncovered_depth_px;
  std::vector<std::size_t> all(cones.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  Agreement agreement;
  agreement.used = all;
  std::vector<std::vector<Mend>> mends(cones.size());
  std::vector<std::vector<AgreementRay>> rays(cones.size());
  NeededDilation needed;
  const bool judge = !(options.keep_all_views && options.dilation_px);
  std::optional<RayCaster> caster;
  if (judge) {
    const Box box = RoughBox(cones, start, agree.max_dilation_px);
    caster.emplace(chosen, cones, box, frame.origin, frame.unit);
    const int rays_per_view = std::clamp(options.max_rays / static_cast<int>(cones.size()), 200, options.rays_per_view);
    ParallelFor(cones.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) rays[v] = caster->Sample(v, rays_per_view);
    });
    // What is off altogether goes first; what a silhouette lacks in places is mended afterwards.
    AgreementOptions rough = agree;
    if (options.max_mended > 0) {
      rough.max_uncovered = std::max(agree.max_uncovered, kRoughlyUncovered);
      rough.max_uncovered_depth_px = std::numeric_limits<double>::infinity();
    }
    agreement = FindAgreement(rays, cones, rough, progress);
    if (agreement.uncovered > kMostUncovered) {
      throw DataError("the silhouettes agree nowhere: no two of them can be of one object",
                      "check the cameras and that masks and photos belong together");
    }
    if (options.keep_all_views) {
      agreement.used = all;
      agreement.left_out.clear();
    }
    needed = FindDilation(rays, cones, agreement.used, agree, progress);
  }
  s.agreement_s = SecondsSince(start_time);

  const auto active = [&] {
    std::vector<const SilhouetteCone*> list;
    for (const std::size_t v : agreement.used) list.push_back(&cones[v]);
    return list;
  };
  const auto shown = [&] {
    std::vector<SilhouetteView> list;
    for (const std::size_t v : agreement.used) list.push_back(chosen[v]);
    return list;
  };
  // Hulls of silhouettes as far apart as is allowed, coarse, show where they disagree.
  const auto settle = [&] {
    const auto from = std::chrono::steady_clock::now();
    MendOptions mend;
    mend.agreement = agree;
    mend.max_mended = options.max_mended;
    mend.leave_out = !options.keep_all_views;
    HullOptions coarse = options;
    coarse.cell_px = std::max(options.cell_px, kSettlingCellPx);
    for (int round = 0; round < kMostSettlings; ++round) {
      const auto contoured = ContourHull(active(), start, agree.max_dilation_px, coarse);
      if (!contoured) break;
      std::vector<std::vector<UncoveredPixel>> uncovered;
      MeasureSilhouettes(InWorld(contoured->mesh, frame), shown(), &uncovered);
      if (!SettleConflicts(chosen, uncovered, *caster, frame.origin, frame.unit, mend, cones, mends, agreement,
                           progress))
        break;
      s.settlings = round + 1;
    }
    needed = FindDilation(rays, cones, agreement.used, agree, progress);
    s.mend_s += SecondsSince(from);
  };
  bool settled = !judge || !(options.max_mended > 0);
  const auto settle_once = [&] {
    if (settled) return false;
    settled = true;
    settle();
    return true;
  };
  if (!needed.enough) settle_once();

  const auto first_dilation = [&] { return options.dilation_px.value_or(std::max(kLeastDilation, needed.px)); };
  double dilation = first_dilation();
  Mesh mesh;
  Progress steps(progress, "visual hull", 0);
  for (int repeat = 0;; ++repeat) {
    start_time = std::chrono::steady_clock::now();
    auto contoured = ContourHull(active(), start, dilation, options);
    s.contour_s += SecondsSince(start_time);
    const double reserve =
        options.dilation_px ? 0 : std::max(options.max_dilation_px, kLeastDilation) + kContourReserve - dilation;
    if (!contoured) {
      if (reserve < kDilationStep || repeat >= kMostRepeats) {
        throw DataError("the silhouettes agree nowhere: their hull is empty",
                        "check the cameras and that masks and photos belong together");
      }
      dilation += kDilationStep;
      continue;
    }
    mesh = InWorld(contoured->mesh, frame);
    s.cell = contoured->cell * frame.unit;
    s.cell_px = contoured->cell_px;
    s.bounded = contoured->bounded;
    start_time = std::chrono::steady_clock::now();
    s.fits = MeasureSilhouettes(mesh, shown());
    s.measure_s += SecondsSince(start_time);
    steps.Step();
    const std::size_t none = s.fits.size();
    std::size_t worst = none;
    for (std::size_t n = 0; n < s.fits.size(); ++n) {
      if (!IsCovered(s.fits[n], options) && (worst == none || s.fits[n].coverage < s.fits[worst].coverage)) worst = n;
    }
    if (worst == none || repeat >= kMostRepeats) break;
    if (dilation >= agree.max_dilation_px && settle_once()) {
      dilation = first_dilation();
    } else if (reserve >= kDilationStep) {
      dilation += kDilationStep;
    } else if (!options.keep_all_views && agreement.used.size() > 2) {
      s.left_out.push_back(
          {chosen[agreement.used[worst]].name,
           fmt::format(
               "the others' hull covers {:.2f} % of its silhouette, and misses a pixel {:.1f} px from its border",
               100 * s.fits[worst].coverage, s.fits[worst].deepest_uncovered_px)});
      agreement.used.erase(agreement.used.begin() + static_cast<std::ptrdiff_t>(worst));
    } else {
      break;
    }
  }
  for (const Disagreement& d : agreement.left_out) {
    s.left_out.push_back(
        {chosen[d.view].name, fmt::format("does not agree with the others: takes {:.1f} % of a silhouette from them, "
                                          "{:.1f} % of its own is covered by none",
                                          100 * d.blame, 100 * d.uncovered)});
  }
  for (const std::size_t v : agreement.used) {
    if (mends[v].empty()) continue;
    const auto before = static_cast<double>(CountObject(chosen[v].mask)),
               after = static_cast<double>(CountObject(Mended(chosen[v].mask, mends[v])));
    if (after > before) s.mended.push_back({chosen[v].name, after / before - 1});
  }
  // Specks where cones happen to meet beside the object: gone, if no pixel of a silhouette misses them.
  for (const std::size_t v : agreement.used) s.used.push_back(chosen[v].name);
  Mesh large = KeepParts(mesh, kSpeck);
  if (large.faces.size() < mesh.faces.size()) {
    const std::vector<SilhouetteFit> fits = MeasureSilhouettes(large, shown());
    bool missed = false;
    for (std::size_t n = 0; n < fits.size(); ++n) missed = missed || fits[n].coverage < s.fits[n].coverage;
    if (!missed) {
      mesh = std::move(large);
      s.fits = fits;
    }
  }
  s.dilation_px = dilation;
  s.fit = Summarize(s.fits);
  s.volume = EnclosedVolume(mesh);
  if (!s.bounded) progress.Message("the views leave the object open to some side: the hull is cut off there");
  if (summary != nullptr) *summary = std::move(s);
  return mesh;
}

}  // namespace lumi
