#include "proxy/summaries.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "scene/geometry/angle.h"

namespace lumi {

void ListKeys(JsonKeys& j, ProxySummary& s) {
  j("name", s.name, "kind", s.kind, "faces", s.faces, "vertices", s.vertices, "closed", s.closed, "seconds", s.seconds);
  j("file", s.file, "reused", s.reused).IfAny("active", s.active);
}

std::string Describe(const ProxySummary& s) {
  return fmt::format("{}: {} faces, {}, {:.2f} s{}", s.file.string(), s.faces, s.closed ? "closed" : "open", s.seconds,
                     s.reused ? " (nothing had changed)" : "");
}

void ListKeys(JsonKeys& j, PlaneSummary& s) {
  j("depth", s.depth, "points_used", s.points_used, "clamped_rays", s.clamped_rays);
}

static void ListKeys(JsonKeys& j, PointSelection& s) {
  j("unusable", s.unusable, "inaccurate", s.inaccurate, "isolated", s.isolated);
}
void ListKeys(JsonKeys& j, DelaunaySummary& s) {
  j("points_used", s.vertices_used, "points_total", s.selection.total, "points_refused", s.selection, "tetrahedra",
    s.tetrahedra);
  j("lines_of_sight", s.rays, "blocked_ray_fraction", s.blocked_ray_fraction);
  JsonKeys steps;
  steps("select", s.select_s, "tetrahedra", s.tetrahedra_s, "lines_of_sight", s.rays_s, "cut", s.cut_s, "surface",
        s.surface_s);
  j.Say("seconds_by_step", steps);
}
std::string Details(const DelaunaySummary& s) {
  return fmt::format("\n{} of {} points, {:.2f} % of {} lines of sight blocked", s.vertices_used, s.selection.total,
                     100 * s.blocked_ray_fraction, s.rays);
}

static std::string DescribeRemovedParts(std::size_t removed) {
  if (removed == 0) return "";
  return fmt::format(
      "\n{} of its parts, the smallest in the photos, are gone: too many faces would have gone into them", removed);
}

static void ListKeys(JsonKeys& j, StereoSummary& s) {
  j("photos", s.photos, "without", s.without, "pixels", s.pixels, "reused", s.reused, "given", s.given, "seconds",
    s.seconds);
}
void ListKeys(JsonKeys& j, DenseSummary& s) {
  j("depth", s.stereo, "fused_points", s.fused_points, "fusion_seconds", s.fusion_s);
  ListKeys(j, s.mesh);
  j("faces_before", s.faces_before, "reached", s.reached, "removed_parts", s.removed_parts, "simplify_seconds",
    s.simplify_s);
}
std::string Details(const DenseSummary& s) {
  std::string out = fmt::format(
      "\n{} photos with depth, {:.1f} s{}; {} points fused, {:.1f} s; {} in the mesh, {:.2f} % of {} lines of sight "
      "blocked",
      s.stereo.photos, s.stereo.seconds,
      s.stereo.given    ? fmt::format(" (maps of {} photos from those made to measure it)", s.stereo.given)
      : s.stereo.reused ? fmt::format(" ({} maps were there)", s.stereo.reused)
                        : "",
      s.fused_points, s.fusion_s, s.mesh.vertices_used, 100 * s.mesh.blocked_ray_fraction, s.mesh.rays);
  if (s.faces_before != 0) out += fmt::format("\nsimplified from {} faces, {:.1f} s", s.faces_before, s.simplify_s);
  out += DescribeRemovedParts(s.removed_parts);
  for (const std::string& name : s.stereo.without)
    out += "\nwithout depth: " + name + " shares too few points with other photos";
  return out;
}
void ListKeys(JsonKeys& j, DepthsSummary& s) {
  j("folder", s.folder, "depth", s.stereo, "reused", s.reused, "seconds", s.seconds);
}
std::string Describe(const DepthsSummary& s) {
  std::string out = fmt::format("{}: depth maps of {} photos, {:.1f} s{}", s.folder.string(), s.stereo.photos,
                                s.seconds, s.reused ? " (nothing had changed)" : "");
  for (const std::string& name : s.stereo.without)
    out += "\nwithout depth: " + name + " shares too few points with other photos";
  return out;
}

void ListKeys(JsonKeys& j, DepthPartSummary& s) {
  std::string part = fmt::format("{}/{}", s.part.index, s.part.count);
  bool finished = s.stereo.unfinished == 0;
  j("folder", s.folder, "part", part, "photos", s.stereo.photos, "finished", finished, "unfinished",
    s.stereo.unfinished, "waits_for", s.stereo.waits_for, "reused", s.stereo.reused, "seconds", s.seconds);
}
std::string Describe(const DepthPartSummary& s) {
  if (s.folder.empty()) return "the scene calls for no depth maps";
  const std::size_t done = s.stereo.photos - s.stereo.unfinished;
  std::string out = fmt::format("part {} of {}: depth maps of {} of {} photos are finished, {:.1f} s", s.part.index,
                                s.part.count, done, s.stereo.photos, s.seconds);
  if (s.stereo.unfinished > 0)
    out += fmt::format("\n{} photos waited for maps of {}: run this part once more", s.stereo.unfinished,
                       s.stereo.waits_for.empty()
                           ? std::string("other parts, which are there now")
                           : fmt::format("part {}, which is to be run before", fmt::join(s.stereo.waits_for, ", ")));
  return out;
}

void ListKeys(JsonKeys& j, BoxSummary& s) {
  Eigen::Vector3d size = s.high - s.low;
  j("points_used", s.points_on_walls, "points_total", s.points, "size", size);
  if (j.reading()) s.high = s.low + size;  // where the box stands is not told
  j("wall_points", s.wall_points, "wall_rms", s.wall_rms);
}

static void ListKeys(JsonKeys& j, PlaneFigures& p) {
  j("normal", p.normal, "offset", p.offset, "points", p.points, "rms", p.rms);
}
void ListKeys(JsonKeys& j, PlanesFigures& s) {
  j("planes", s.planes, "points_used", s.points_on_planes, "points_total", s.points, "backdrop_added", s.backdrop_added,
    "quads", s.quads);
}

void ListKeys(JsonKeys& j, MovingFigures& s) {
  MovingSummary& m = s.surface;
  std::array<int, 2> grid{m.columns, m.rows};
  j("over", s.over, "photos", m.photos, "moments", m.moments, "depths", m.depths, "grid", grid, "moving_samples",
    m.region);
  m.columns = grid[0];
  m.rows = grid[1];
  j("surface_samples", m.surface, "depth_nearest", m.nearest, "depth_median", m.median_depth, "depth_farthest",
    m.farthest, "agreement_gain", m.gain);
}

static void ListKeys(JsonKeys& j, PairsFigures& s) {
  j("count", s.count, "rms", s.rms, "rms_of_extent", s.rms_of_extent, "distances", s.distances);
}
static void ListKeys(JsonKeys& j, IcpResult& r) {
  j("rms", r.rms, "rms_of_diagonal", r.rms_of_diagonal, "points", r.points, "overlap", r.overlap, "iterations",
    r.iterations);
}
static void ListKeys(JsonKeys& j, Similarity3& s) {
  const Eigen::AngleAxisd rotation(s.rotation);
  double angle_deg = kDegPerRad * rotation.angle();
  Eigen::Vector3d axis = rotation.axis();
  j("scale", s.scale, "rotation_deg", angle_deg, "rotation_axis", axis, "translation", s.translation);
  if (j.reading()) s.rotation = Eigen::AngleAxisd(angle_deg / kDegPerRad, axis.normalized());
}
static void ListKeys(JsonKeys& j, MeshFlaws& f) {
  j("not_finite_vertices", f.not_finite_vertices, "duplicate_vertices", f.duplicate_vertices, "duplicate_faces",
    f.duplicate_faces);
  j("zero_area_faces", f.zero_area_faces, "non_manifold_edges", f.non_manifold_edges, "non_manifold_vertices",
    f.non_manifold_vertices);
  j("turned_faces", f.turned_faces, "inside_out_parts", f.inside_out_parts);
}
void ListKeys(JsonKeys& j, ImportFigures& s) {
  j.IfAny("pairs", s.pairs).IfAny("icp", s.icp);
  j("placement", s.placement, "repaired", s.repaired, "parts", s.parts, "soundness", s.soundness);
  j("coverage", s.coverage, "front_fraction", s.front_fraction);
}
std::string Details(const ImportFigures& s) {
  std::string out = "\n" + s.soundness;
  if (s.pairs) out += fmt::format("\nplaced by {} pairs of points, {:.4g} apart (rms)", s.pairs->count, s.pairs->rms);
  if (s.icp)
    out += fmt::format(
        "\naligned with the points: {:.4g} apart (rms, {:.2f} % of the mesh's diagonal) over {:.0f} % of the {} points "
        "near it, {} iterations, scale {:.6g}",
        s.icp->rms, 100 * s.icp->rms_of_diagonal, 100 * s.icp->overlap, s.icp->points, s.icp->iterations,
        s.placement.scale);
  return out + fmt::format("\nthe views see it in {:.1f} % of their rays", 100 * s.coverage);
}

static void ListKeys(JsonKeys& j, HullSummary::LeftOut& l) { j("name", l.name, "reason", l.reason); }
static void ListKeys(JsonKeys& j, HullSummary::MendedView& m) { j("name", m.name, "share", m.share); }
static void ListKeys(JsonKeys& j, SilhouetteFitSummary& f) {
  j("coverage_min", f.coverage_min, "iou_min", f.iou_min, "iou_median", f.iou_median, "deepest_uncovered_px",
    f.deepest_uncovered_px);
}
namespace {
struct HullSteps {
  HullSummary& of;
};
void ListKeys(JsonKeys& j, HullSteps& s) {
  j("agreement", s.of.agreement_s, "mending", s.of.mend_s, "contour", s.of.contour_s, "measure", s.of.measure_s);
}
}  // namespace
void ListKeys(JsonKeys& j, HullFigures& s) {
  HullSummary& h = s.hull;
  ListKeys(j, h.fit);
  std::string prefer = h.tight ? "tight" : "cover";
  j("prefer", prefer, "coarse_hulls", h.coarse_hulls, "fine_hulls", h.fine_hulls);
  if (j.reading()) h.tight = prefer == "tight";
  j("dilation_px", h.dilation_px, "cell_px", h.cell_px, "cell", h.cell, "volume", h.volume, "bounded", h.bounded,
    "sound", s.sound, "soundness", s.soundness);
  j("parts", s.parts, "views_used", s.views_used, "views_left_out", h.left_out, "views_mended", h.mended);
  HullSteps steps{h};
  j("seconds_by_step", steps);
}
std::string Details(const HullFigures& s) {
  const HullSummary& h = s.hull;
  std::string out = fmt::format(
      "\n{}; volume {:.6g}{}\n{} views: covered {:.2f} % at least, deepest uncovered pixel {:.1f} px from the border, "
      "after a dilation of {:.2f} px; "
      "intersection over union {:.4f} median, {:.4f} least",
      s.soundness, h.volume, h.bounded ? "" : ", cut off: the views leave it open to a side", s.views_used,
      100 * h.fit.coverage_min, h.fit.deepest_uncovered_px, h.dilation_px, h.fit.iou_median, h.fit.iou_min);
  if (!h.tight && (h.dilation_px > kLeastDilation || !h.mended.empty()))
    out +=
        "\nthe silhouettes disagree a little, and all are covered: --prefer tight has more in common with them (IoU), "
        "and --tradeoff both beside each other";
  double most = 0;
  for (const auto& m : h.mended) most = std::max(most, m.share);
  if (!h.mended.empty())
    out += fmt::format("\n{} silhouettes mended where they lack what others show, by {:.1f} % at most", h.mended.size(),
                       100 * most);
  for (const auto& l : h.left_out) out += fmt::format("\nleft out {}: {}", l.name, l.reason);
  return out;
}

static void ListKeys(JsonKeys& j, MissedView& v) {
  j("name", v.name, "coverage", v.coverage, "deepest_uncovered_px", v.deepest_uncovered_px);
}
void ListKeys(JsonKeys& j, SimplifiedFit& s) {
  j("mean_distance_px", s.mean_distance_px, "max_distance_px", s.max_distance_px, "sound", s.sound, "soundness",
    s.soundness, "parts", s.parts);
  j("intersects_itself", s.intersects_itself).IfAny("volume", s.volume).IfAny("volume_ratio", s.volume_ratio);
  if (j.reading() ? j.Has("coverage_min") : s.silhouettes.has_value()) {
    ListKeys(j, s.silhouettes ? *s.silhouettes : s.silhouettes.emplace());
    j("views_used", s.views_used, "views_missed", s.views_missed);
  } else {
    std::optional<double> none;
    j("coverage_min", none, "iou_min", none, "iou_median", none, "deepest_uncovered_px", none);
  }
}
void ListKeys(JsonKeys& j, SimplifyFigures& s) {
  j("from", s.from, "method", s.method, "wanted", s.wanted, "faces_before", s.faces_before, "reached", s.reached,
    "wrapped", s.wrapped, "removed_parts", s.removed_parts, "simplify_s", s.simplify_s);
  ListKeys(j, s.fit);
}
std::string Describe(const Made<SimplifyFigures>& s) {
  if (!s.figures) return Describe(static_cast<const ProxySummary&>(s));
  const SimplifyFigures& f = *s.figures;
  std::string out =
      fmt::format("{}: {} faces of {}'s {}, {}, {:.2f} s{}\n{}", s.file.string(), s.faces, f.from, f.faces_before,
                  f.method, s.seconds, s.reused ? " (nothing had changed)" : "", f.fit.soundness);
  if (f.fit.intersects_itself) out += ", runs through itself";
  if (f.wrapped) out += "; of a wrap, which closes narrow gaps";
  if (f.wrapped && f.method == "quadric") out += " and loses what is small beside the whole (--in-pixels keeps it)";
  if (f.fit.volume_ratio) out += fmt::format("; volume {:.4f} of what it was", *f.fit.volume_ratio);
  out +=
      fmt::format("\ndistance {:.2f} px in the mean, {:.1f} px at most", f.fit.mean_distance_px, f.fit.max_distance_px);
  out += DescribeRemovedParts(f.removed_parts);
  if (!f.fit.silhouettes) return out + "\nno silhouettes: what it covers of them was not measured";
  const SilhouetteFitSummary& covered = *f.fit.silhouettes;
  out += fmt::format(
      "\n{} silhouettes: covered {:.2f} % at least, deepest uncovered pixel {:.1f} px; intersection over union {:.4f} "
      "median, {:.4f} least",
      f.fit.views_used, 100 * covered.coverage_min, covered.deepest_uncovered_px, covered.iou_median, covered.iou_min);
  std::vector<MissedView> missed = f.fit.views_missed;
  std::ranges::stable_sort(missed, [](const MissedView& a, const MissedView& b) { return a.coverage < b.coverage; });
  if (!missed.empty())
    out += fmt::format("\n{} silhouettes not covered to {:g} % and {:g} px, the worst:", missed.size(),
                       100 * kLeastCoverage, kDeepestUncoveredPx);
  missed.resize(std::min<std::size_t>(3, missed.size()));
  for (const MissedView& v : missed)
    out += fmt::format("\nnot covered: {}, {:.2f} %, {:.1f} px deep", v.name, 100 * v.coverage, v.deepest_uncovered_px);
  return out;
}

static void ListKeys(JsonKeys& j, FoundSilhouette& f) {
  std::string kind = Name(f.info.kind);
  j("name", f.name, "kind", kind);
  if (j.reading())
    for (const auto known :
         {SilhouetteKind::kNormal, SilhouetteKind::kEmpty, SilhouetteKind::kFull, SilhouetteKind::kTiny})
      if (Name(known) == kind) f.info.kind = known;
  j("pixels", f.info.pixels, "parts", f.info.parts, "holes", f.info.holes, "touches_border", f.info.touches_border,
    "no_mask", f.no_mask);
}
void ListKeys(JsonKeys& j, SilhouettesSummary& s) {
  j("folder", s.folder, "silhouettes", s.silhouettes, "empty", s.empty, "full", s.full, "tiny", s.tiny, "reused",
    s.reused, "seconds", s.seconds);
}
std::string Describe(const SilhouettesSummary& s) {
  std::string out = fmt::format("{} silhouettes in {}, {:.2f} s{}", s.silhouettes.size(), s.folder.string(), s.seconds,
                                s.reused ? " (nothing had changed)" : "");
  for (const FoundSilhouette& f : s.silhouettes)
    if (f.no_mask)
      out += fmt::format("\n{}: has no mask and counts as empty", f.name);
    else if (f.info.kind != SilhouetteKind::kNormal)
      out += fmt::format("\n{}: {}, {} pixels", f.name, Name(f.info.kind), f.info.pixels);
    else if (f.info.touches_border)
      out += fmt::format("\n{}: touches the photo's border", f.name);
  return out;
}

static void ListKeys(JsonKeys& j, ProxyCandidate& c) {
  j("name", c.name, "psnr_mean_db", c.psnr_db, "psnr_object_mean_db", c.psnr_object_db, "ssim_mean", c.ssim, "coverage",
    c.coverage, "ms_per_frame", c.ms);
  j("faces", c.faces, "closed", c.closed).Say("seconds", c.build_s + c.measure_s);
  j("build_seconds", c.build_s, "measure_seconds", c.measure_s).IfAny("refused", c.refused);
  j.IfAny("evaluated", c.evaluated);
}
void ListKeys(JsonKeys& j, AutoTable& t) {
  j("holdout", t.holdout, "choose_width_px", t.choose_width_px, "unmeasured", t.unmeasured, "fold", t.fold,
    "candidates", t.candidates, "reused", t.reused);
  j.IfAny("dense_width_px", t.dense_width_px).IfAny("evaluated_without", t.evaluated_without);
}
void ListKeys(JsonKeys& j, AutoSummary& s) {
  j("name", s.name, "faces", s.faces, "closed", s.closed, "seconds", s.seconds, "reason", s.reason)
      .IfAny("budget_ms", s.budget_ms);
  ListKeys(j, s.table);
}
std::string Describe(const AutoSummary& s) {
  std::string out = fmt::format("{:<14} {:>8} {:>9} {:>10} {:>8} {:>9} {:>9} {:>8} {:>10}\n", "proxy", "faces",
                                "PSNR dB", "object dB", "SSIM", "coverage", "ms/frame", "built s", "measured s");
  for (const ProxyCandidate& c : s.table.candidates) {
    if (!c.refused.empty()) {
      out += fmt::format("{:<14} {}\n", c.name, c.refused);
    } else if (!c.psnr_db) {
      out += fmt::format("{:<14} {:>8} {:>9} {:>10} {:>8} {:>9} {:>9} {:>8.2f} {:>10}\n", c.name, c.faces, "-", "-",
                         "-", "-", "-", c.build_s, "-");
    } else {
      out += fmt::format("{:<14} {:>8} {:>9.2f} {:>10} {:>8.4f} {:>8.1f}% {:>9.1f} {:>8.2f} {:>10.2f}\n", c.name,
                         c.faces, *c.psnr_db, c.psnr_object_db ? fmt::format("{:.2f}", *c.psnr_object_db) : "-",
                         *c.ssim, 100 * *c.coverage, *c.ms, c.build_s, c.measure_s);
    }
  }
  return out + fmt::format("active: {} ({}), {} px wide; {:.1f} s{}", s.name, s.reason, s.table.choose_width_px,
                           s.seconds, s.table.reused ? ", nothing had changed" : "");
}

std::string DescribeSurface(const Soundness& sound) {
  if (!sound.manifold) return "not 2-manifold and oriented";
  return fmt::format("{}, 2-manifold{}, {}", sound.closed ? "closed" : "open",
                     !sound.closed   ? ""
                     : sound.outward ? ", front faces outwards"
                                     : ", front faces inwards",
                     sound.degenerate_faces == 0 ? std::string("no degenerate face")
                                                 : fmt::format("{} degenerate faces", sound.degenerate_faces));
}
static void ListKeys(JsonKeys& j, ProxyInfo& p) {
  j("name", p.name, "faces", p.faces, "vertices", p.vertices, "closed", p.closed, "manifold", p.sound.manifold,
    "degenerate_faces", p.sound.degenerate_faces);
  j("parts", p.sound.parts).Say("soundness", DescribeSurface(p.sound));
  j("active", p.active, "coverage", p.fit.coverage, "coverage_min", p.fit.coverage_min);
  j("front_fraction", p.fit.front_fraction, "layers_mean", p.fit.layers_mean, "layers_max", p.fit.layers_max,
    "blocked_ray_fraction", p.fit.blocked_ray_fraction);
  j("lines_of_sight", p.fit.lines_of_sight, "point_distance_median", p.fit.distance_median, "point_distance_95",
    p.fit.distance_95, "seconds", p.seconds);
}
void ListKeys(JsonKeys& j, InfoSummary& s) {
  j("active_proxy", s.active_proxy, "one", s.one, "views", s.views, "points", s.points, "reliable_points",
    s.reliable_points, "proxies", s.proxies, "seconds", s.seconds);
}
std::string Describe(const InfoSummary& s) {
  std::string out = fmt::format("{} views, {} points, {} of them reliable\n", s.views, s.points, s.reliable_points);
  if (s.proxies.empty())
    return out +
           "no proxy yet: lumi-proxy auto makes one in a scene of ours; lumi-pipeline WORKSPACE -o SCENE makes a scene "
           "of "
           "another tool's workspace";
  if (s.one) {
    const ProxyInfo& p = s.proxies.front();
    const MeshFit& f = p.fit;
    return out +
           fmt::format(
               "{}{}: {} faces, {} vertices, {} parts\n  {}\n"
               "  coverage of the views    {:.1f} % of their rays, {:.1f} % of the least covered; fronts {:.1f} %\n"
               "  depth complexity         {:.2f} layers a ray that meets it, {} at most\n"
               "  off the points           {:.3f} % of their depth in the middle, {:.3f} % for 95 of 100\n"
               "  lines of sight blocked   {:.2f} % of {}",
               p.name, p.active ? " (active)" : "", p.faces, p.vertices, p.sound.parts, DescribeSurface(p.sound),
               100 * f.coverage, 100 * f.coverage_min, 100 * f.front_fraction, f.layers_mean, f.layers_max,
               100 * f.distance_median, 100 * f.distance_95, 100 * f.blocked_ray_fraction, f.lines_of_sight);
  }
  const auto yes = [](bool flag) { return flag ? "yes" : "no"; };
  out += fmt::format("{:<14} {:>8} {:>7} {:>9} {:>9} {:>7} {:>7} {:>8} {:>16}", "proxy", "faces", "closed", "manifold",
                     "coverage", "front", "layers", "blocked", "off the points");
  for (const ProxyInfo& p : s.proxies)
    out += fmt::format("\n{:<14} {:>8} {:>7} {:>9} {:>8.1f}% {:>6.1f}% {:>7.2f} {:>7.2f}% {:>8.3f}% depth{}", p.name,
                       p.faces, yes(p.closed), yes(p.sound.manifold), 100 * p.fit.coverage, 100 * p.fit.front_fraction,
                       p.fit.layers_mean, 100 * p.fit.blocked_ray_fraction, 100 * p.fit.distance_median,
                       p.active ? "  (active)" : "");
  return out;
}

}  // namespace lumi
