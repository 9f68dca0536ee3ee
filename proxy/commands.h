// What lumi-proxy does: the subcommands. Each returns its summary (summaries.h).
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "proxy/hull/visual_hull.h"
#include "proxy/silhouettes/silhouette_files.h"
#include "proxy/summaries.h"
#include "scene/program/progress.h"
#include "scene/tradeoff/table.h"

namespace lumi {

// --leave-out each: as many proxies as scene/files/evaluation_proxy.h names, one at a time (`fold`).
constexpr int kLeaveOutEach = -1;

struct ProxyTarget {
  std::filesystem::path scene;   // scene folder, COLMAP workspace or transforms.json
  std::string name;              // of the proxy in the scene
  std::filesystem::path output;  // a mesh file instead of the scene's own folder; empty: the scene's
  bool activate = false;         // make it the scene's default also where there is one already
  // N: for an evaluation by `lumi-render --holdout N`, made without the photos that it compares with and, unless
  // keep_choosing_fold, those that anything is chosen on; kept as NAME-without-N and never active. 0: of all photos.
  int leave_out = 0;
  bool keep_choosing_fold = false;  // then under the name given
  int fold = 0;                     // of kLeaveOutEach: made without photos fold, fold + 5 ...
};
// The name that it is kept under.
std::string StoredName(const ProxyTarget& target);
// --leave-out's word: N, or each. Throws UsageError.
int LeaveOutFrom(const std::string& text);

// The proxies that `lumi-render --holdout each` renders over: `make` makes the one of each fold that has photos.
struct EachSummary {
  std::string name;  // that they stand for
  std::vector<ProxySummary> proxies;
  double seconds = 0;
};
EachSummary RunForEach(const ProxyTarget& target, ProgressSink& progress,
                       const std::function<ProxySummary(const ProxyTarget&)>& make);
void ListKeys(JsonKeys& j, EachSummary& summary);
std::string Describe(const EachSummary& summary);

Made<PlaneSummary> RunPlane(const ProxyTarget& target, ProgressSink& progress);

// `merge_px`: points nearer than this many pixels in the view that sees them finest become one.
Made<DelaunaySummary> RunDelaunay(const ProxyTarget& target, double merge_px, ProgressSink& progress);

// A mesh through dense points: PatchMatch stereo between all photos, fused (docs/dense.md).
struct DenseRequest {
  DenseOptions dense = {};
  std::filesystem::path from_depth;  // a folder with depth_maps/, made elsewhere; empty: our own stereo
  std::uint64_t seed = 0;
  int maps_without = 0;     // N: maps made for an evaluation with every N-th photo left out are taken, others added
  bool depth_only = false;  // maps in COLMAP's layout, no mesh
};
Made<DenseSummary> RunDense(const ProxyTarget& target, const DenseRequest& request, ProgressSink& progress);
// SCENE/stereo/depth_maps and normal_maps of all photos, or the same in `target.output`.
DepthsSummary RunDenseDepths(const ProxyTarget& target, const DenseRequest& request, ProgressSink& progress);

// A part of the photos' maps (StereoMaps), kept where RunDense and RunDenseDepths of the same target and options look
// for them. Throws UsageError for a target outside of the scene, and where maps of other options were made in parts.
DepthPartSummary RunDensePart(const ProxyTarget& target, const DenseRequest& request, const Part& part,
                              ProgressSink& progress);

// Width, views, iterations, agreement and merging, one at a time from what is given, against the error of left-out
// photos and seconds: `output`/dense.json, .csv and .svg, SCENE/tradeoff where it is empty.
struct DenseTradeoffRequest {
  DenseRequest dense;
  int holdout = 8;            // every N-th photo is left out, measured on N/2, N/2 + N ...
  int choose_width_px = 480;  // of the pictures that are compared
};
struct DenseTradeoff {
  TradeoffTable table;
  TradeoffFiles files;
  double seconds = 0;
};
DenseTradeoff RunDenseTradeoff(const ProxyTarget& target, const DenseTradeoffRequest& request, ProgressSink& progress);
void ListKeys(JsonKeys& j, DenseTradeoff& tradeoff);
std::string Describe(const DenseTradeoff& tradeoff);

// A rectangular tube around the cameras' path, of 4 to 6 sides (docs/proxy.md).
Made<BoxSummary> RunBox(const ProxyTarget& target, int sides, ProgressSink& progress);

struct PlanesRequest {
  PlanesOptions planes = {};
  std::filesystem::path from;  // JSON of quads and planes to take instead of looking for some
};
Made<PlanesFigures> RunPlanes(const ProxyTarget& target, const PlanesRequest& request, ProgressSink& progress);

// A surface for what moves before a proxy of what stands still (proxy/moving/moving_proxy.h).
struct MovingRequest {
  std::string over = "delaunay";  // the proxy of what stands still; made where it is "delaunay" and not there
  MovingOptions moving = {};
};
Made<MovingFigures> RunMoving(const ProxyTarget& target, const MovingRequest& request, ProgressSink& progress);
// Why the scene does not call for one, or empty.
std::string UnfitForMoving(const Scene& scene);

// A mesh that somebody else made, brought into the scene's frame and mended (docs/proxy.md).
struct ImportRequest {
  std::filesystem::path file;  // PLY or OBJ
  double scale = 1;            // factor on its coordinates, > 0
  // Of its coordinates, the scene's being metres or measured: um, mm, cm, dm, m, km, in, ft; empty: the scene's own.
  std::string unit;
  std::string axes;                  // "z-up", "x,-z,y" ... (proxy/import/placement.h); empty: the scene's own
  std::filesystem::path correspond;  // pairs of points, instead of the three above; empty: none
  bool icp = false;                  // then aligned with the scene's points
  bool repair = true;                // false: what is not sound is refused
};
Made<ImportFigures> RunImport(const ImportRequest& request, const ProxyTarget& target, ProgressSink& progress);

struct HullRequest {
  std::filesystem::path silhouettes;  // a folder; empty: the scene's own
  HullOptions hull;
  CleanOptions clean;
};
Made<HullFigures> RunHull(const HullRequest& request, const ProxyTarget& target, ProgressSink& progress);

// Views and detail against tightness and seconds (proxy/hull/hull_tradeoff.h): `output`/hull.json, .csv and .svg,
// SCENE/tradeoff where it is empty. Keys: hull_tradeoff{silhouettes, points[...], seconds}, tradeoff_json,
// tradeoff_csv, tradeoff_svg.
struct HullTradeoff {
  TradeoffTable table;
  TradeoffFiles files;
  std::size_t silhouettes = 0;
  double seconds = 0;
};
HullTradeoff RunHullTradeoff(const HullRequest& request, const std::filesystem::path& scene,
                             const std::filesystem::path& output, ProgressSink& progress);
void ListKeys(JsonKeys& j, HullTradeoff& tradeoff);
std::string Describe(const HullTradeoff& tradeoff);

struct SimplifyRequest {
  int faces = 500;
  std::string from;                   // a proxy of the scene; empty: the active one, or what that was simplified from
  bool keep_hull = false;             // enclose the former, where else quadrics decide
  bool in_pixels = false;             // distances count as the photos show them, else as they are in the world
  std::filesystem::path silhouettes;  // to be measured against; empty: the scene's own, where it has some
};
// target.name empty: FROM-FACES, with -kept where the hull is kept.
Made<SimplifyFigures> RunSimplify(const SimplifyRequest& request, const ProxyTarget& target, ProgressSink& progress);

struct SimplifyTradeoffRequest {
  std::filesystem::path scene;
  std::string from;
  std::filesystem::path silhouettes;
  std::vector<int> faces = {100, 200, 500, 1000, 2000, 5000, 20000};
  bool render = true;  // ask lumi-render for the error of left-out photos
  int holdout = 8;     // every N-th photo is left out, measured on N/2, N/2 + N ...
  int width_px = 480;  // of the pictures that are compared
};
struct SimplifyTradeoffRow {
  std::string method;
  std::size_t wanted = 0;
  std::string failed;  // why there is no such mesh; empty: there is one
  std::size_t faces = 0;
  double seconds = 0;
  bool reached = true;
  SimplifiedFit fit;
  std::optional<double> psnr_db, ms_per_frame;  // of left-out photos; none: not asked for, or too few photos
};
struct SimplifyTradeoff {
  std::string from;  // the proxy that was simplified
  std::size_t faces = 0;
  bool closed = false;
  double seconds = 0;
  std::vector<SimplifyTradeoffRow> rows;
  TradeoffFiles files;
};
// Faces against error against time, both ways where the mesh is closed; kept in SCENE/tradeoff/simplify-FROM.json, .csv
// and .svg.
SimplifyTradeoff RunSimplifyTradeoff(const SimplifyTradeoffRequest& request, ProgressSink& progress);
void ListKeys(JsonKeys& j, SimplifyTradeoff& tradeoff);
std::string Describe(const SimplifyTradeoff& tradeoff);

// Silhouettes of the scene's photos, into SCENE/silhouettes or `output`.
SilhouettesSummary RunSilhouettes(const std::filesystem::path& scene, const SilhouetteSource& source,
                                  const CleanOptions& clean, const std::filesystem::path& output,
                                  ProgressSink& progress);

struct AutoOptions {
  std::filesystem::path scene;
  int choose_width_px = 480;        // of the pictures that are compared
  int holdout = 8;                  // every N-th photo is left out; the choice is made on N/2, N/2 + N ...
  std::optional<double> budget_ms;  // a frame of that width: the best within it; none: the best
  // For depth maps of all photos, once without those that it is chosen and reported on and once with all; their size
  // follows from it and from how fast this machine is. 0: none are made. Not given: from the photos' number alone, 640
  // pixels wide up to 120 photos of 4:3, 480 up to 213, 320 up to 1,000, none of more.
  std::optional<double> proxy_minutes;
  std::optional<int> depth_width_px;  // longer side of the depth maps, however long they take
  std::vector<std::string>
      candidates;  // of plane, planes, box, delaunay, hull and the scene's own proxies; empty: the first five
};
// Makes the candidates that the data allow, asks lumi-render for the error of each on the fold for choosing, makes the
// best one the scene's active proxy. One that cannot be made or measured is a row with its reason. A proxy of a
// candidate's name and kind that is there already, of these cameras and points, is taken as it is.
AutoSummary RunAuto(const AutoOptions& options, ProgressSink& progress);
// A part of the depth maps that RunAuto measures dense proxies by, so that it finds them. Not with proxy_minutes, which
// other machines would take other sizes for.
DepthPartSummary RunAutoPart(const AutoOptions& options, const Part& part, ProgressSink& progress);

// What proxies a scene has and how they fit: soundness, coverage, depth complexity, blocked lines of sight, distance to
// the points. Writes nothing. `name`: of one; empty: all.
InfoSummary RunInfo(const std::filesystem::path& scene, const std::string& name, ProgressSink& progress);

}  // namespace lumi
