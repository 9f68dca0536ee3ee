// What each command of lumi-proxy answers: a struct, its keys in JSON (ListKeys), its text for people (Describe).
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "proxy/box/box_proxy.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "proxy/dense/dense_proxy.h"
#include "proxy/hull/soundness.h"
#include "proxy/hull/visual_hull.h"
#include "proxy/import/icp.h"
#include "proxy/import/mesh_repair.h"
#include "proxy/mesh_query.h"
#include "proxy/moving/moving_proxy.h"
#include "proxy/plane/plane_proxy.h"
#include "proxy/planes/planes_proxy.h"
#include "proxy/silhouettes/silhouette_files.h"
#include "scene/files/json_keys.h"
#include "scene/geometry/similarity3.h"

namespace lumi {

// Of every command that makes a mesh.
struct ProxySummary {
  std::string name, kind;
  std::size_t faces = 0, vertices = 0;
  bool closed = false, reused = false;
  std::optional<bool> active;  // none: it went to a file of its own
  double seconds = 0;
  std::filesystem::path file;
};

// With what its own kind has to say; none where an earlier run made it and left no record.
template <typename Figures>
struct Made : ProxySummary {
  std::optional<Figures> figures;
};

struct PlaneFigures {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0;       // normal . x = offset, world
  std::size_t points = 0;  // on it; 0: given, or the backdrop
  double rms = 0;          // of their distances, in world units
};
struct PlanesFigures {
  std::vector<PlaneFigures> planes;
  std::size_t points = 0, points_on_planes = 0;
  bool backdrop_added = false;
  std::size_t quads = 0;  // given
};

struct MovingFigures {
  std::string over;  // the proxy of what stands still
  MovingSummary surface;
};

struct PairsFigures {
  std::size_t count = 0;
  double rms = 0, rms_of_extent = 0;
  std::vector<double> distances;  // of each pair, in world units
};
struct ImportFigures {
  std::optional<PairsFigures> pairs;
  std::optional<IcpResult> icp;
  Similarity3 placement;  // scene_from_mesh
  MeshFlaws repaired;
  int parts = 0;
  std::string soundness;
  double coverage = 0, front_fraction = 0;
};

struct DepthsSummary {
  std::filesystem::path folder;
  StereoSummary stereo;
  bool reused = false;
  double seconds = 0;
};

// Of a part of the photos' depth maps.
struct DepthPartSummary {
  std::filesystem::path folder;  // where they wait for the run that joins them; empty: the scene calls for none
  Part part;
  StereoSummary stereo;
  double seconds = 0;
};

struct HullFigures {
  HullSummary hull;
  std::size_t views_used = 0, parts = 0;
  bool sound = false;
  std::string soundness;
};

struct MissedView {
  std::string name;
  double coverage = 0, deepest_uncovered_px = 0;
};
// A simplified mesh beside the one that it was made from.
struct SimplifiedFit {
  double mean_distance_px = 0, max_distance_px = 0;  // in the median view
  bool sound = false, intersects_itself = false;
  std::string soundness;
  std::size_t parts = 0;
  std::optional<double> volume, volume_ratio;       // of closed meshes
  std::optional<SilhouetteFitSummary> silhouettes;  // where there are some, and the mesh is closed
  std::size_t views_used = 0;
  std::vector<MissedView> views_missed;  // not covered as a hull covers them
};
struct SimplifyFigures {
  std::string from, method;
  int wanted = 0;
  std::size_t faces_before = 0;
  bool reached = true, wrapped = false;
  std::size_t removed_parts = 0;
  double simplify_s = 0;
  SimplifiedFit fit;
};

struct SilhouettesSummary {
  std::filesystem::path folder;
  std::vector<FoundSilhouette> silhouettes;
  std::size_t empty = 0, full = 0, tiny = 0;
  bool reused = false;
  double seconds = 0;
};

struct ProxyCandidate {
  std::string name;
  std::string refused;    // why it cannot be made or measured here, or empty
  std::string evaluated;  // the proxy that was measured in its place, made without the photos left out; empty: itself
  std::size_t faces = 0;
  bool closed = false;
  bool made = false;
  double build_s = 0, measure_s = 0;
  std::optional<double> psnr_db, ssim, coverage, ms;
  std::optional<double> psnr_object_db;  // over the object's pixels, where the scene has silhouettes
};
// What was measured; kept, for a run that has nothing to do but to choose.
struct AutoTable {
  int holdout = 0, choose_width_px = 0;
  std::string unmeasured, fold;  // why nothing may have been measured; the photos that were left out
  std::vector<ProxyCandidate> candidates;
  bool reused = false;
  std::optional<int> dense_width_px;     // of depth maps, where they were made
  std::optional<int> evaluated_without;  // N: what was measured was made without photos 0, N ... and N/2, N/2 + N ...
};
struct AutoSummary {
  std::string name;  // of the active proxy
  std::string reason;
  std::size_t faces = 0;
  bool closed = false;
  double seconds = 0;
  std::optional<double> budget_ms;
  AutoTable table;
};

struct ProxyInfo {
  std::string name;
  std::size_t faces = 0, vertices = 0;
  bool closed = false, active = false;
  Soundness sound;
  MeshFit fit;
  double seconds = 0;
};
struct InfoSummary {
  std::string active_proxy;
  bool one = false;  // was asked for by name
  std::size_t views = 0, points = 0, reliable_points = 0;
  std::vector<ProxyInfo> proxies;
  double seconds = 0;
};

void ListKeys(JsonKeys& j, ProxySummary& s);
void ListKeys(JsonKeys& j, PlaneSummary& s);
void ListKeys(JsonKeys& j, DelaunaySummary& s);
void ListKeys(JsonKeys& j, DenseSummary& s);
void ListKeys(JsonKeys& j, DepthsSummary& s);
void ListKeys(JsonKeys& j, DepthPartSummary& s);
void ListKeys(JsonKeys& j, BoxSummary& s);
void ListKeys(JsonKeys& j, PlanesFigures& s);
void ListKeys(JsonKeys& j, MovingFigures& s);
void ListKeys(JsonKeys& j, ImportFigures& s);
void ListKeys(JsonKeys& j, HullFigures& s);
void ListKeys(JsonKeys& j, SimplifiedFit& s);
void ListKeys(JsonKeys& j, SimplifyFigures& s);
void ListKeys(JsonKeys& j, SilhouettesSummary& s);
void ListKeys(JsonKeys& j, AutoTable& s);
void ListKeys(JsonKeys& j, AutoSummary& s);
void ListKeys(JsonKeys& j, InfoSummary& s);
template <typename Figures>
void ListKeys(JsonKeys& j, Made<Figures>& s) {
  ListKeys(j, static_cast<ProxySummary&>(s));
  if (s.figures) ListKeys(j, *s.figures);
}

std::string Describe(const ProxySummary& s);
// The lines below the first.
template <typename Figures>
std::string Details(const Figures&) {
  return {};
}
std::string Details(const DelaunaySummary& s);
std::string Details(const DenseSummary& s);
std::string Details(const ImportFigures& s);
std::string Details(const HullFigures& s);
template <typename Figures>
std::string Describe(const Made<Figures>& s) {
  return Describe(static_cast<const ProxySummary&>(s)) + (s.figures ? Details(*s.figures) : std::string());
}
std::string Describe(const Made<SimplifyFigures>& s);
std::string Describe(const DepthsSummary& s);
std::string Describe(const DepthPartSummary& s);
std::string Describe(const SilhouettesSummary& s);
std::string Describe(const AutoSummary& s);
std::string Describe(const InfoSummary& s);

// Of a surface that may be a room's, whose fronts look inwards: which way they look is no flaw.
std::string DescribeSurface(const Soundness& sound);

// What a hull promises of every silhouette used.
inline constexpr double kLeastCoverage = 0.995, kDeepestUncoveredPx = 2;

}  // namespace lumi
