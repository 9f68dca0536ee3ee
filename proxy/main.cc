// lumi-proxy: the rough geometry that a lumigraph's photographs are blended over.
#include "proxy/commands.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "scene/program/error.h"
#include "scene/program/main_program.h"

namespace lumi {
namespace {

void AddTarget(Options& command, ProxyTarget& target, bool named) {
  command.Add("scene", target.scene, "Scene folder (or with --output: COLMAP workspace, transforms.json)").Required();
  if (named) command.Add("--name", target.name, "Name of the proxy in the scene").Default();
  command.Add("-o,--output", target.output, "Write this .ply or .obj file instead, nothing into the scene");
  command.Flag("--activate", target.activate, "Make it the scene's active proxy even where there is one");
}

void AddLeaveOut(Options& command, ProxyTarget& target) {
  command.Call(
      "--leave-out", [&target](const std::string& text) { target.leave_out = LeaveOutFrom(text); },
      "For an evaluation by lumi-render --holdout N: made without its photos and those that anything is chosen on, "
      "kept "
      "as NAME-without-N; N >= 2. each, for --holdout each: five, each without every fifth photo, kept as "
      "NAME-without-each-K-of-5");
  command.Flag("--keep-choosing-fold", target.keep_choosing_fold,
               "With --leave-out: only photos 0, N, 2N ... are left out; kept under the name given");
}

// What `make` makes of the target, or of each fold of its photos.
template <typename Make>
Answer MadeFor(const ProxyTarget& target, ProgressSink& progress, const Make& make) {
  if (target.leave_out != kLeaveOutEach) return make(target);
  return RunForEach(target, progress, [&](const ProxyTarget& fold) -> ProxySummary { return make(fold); });
}

void AddClean(Options& command, CleanOptions& clean) {
  command.Add("--close-px", clean.close_px, "Gaps about twice as wide are bridged, in pixels, 0..100").Default();
  command.Add("--grow-px", clean.grow_px, "Widened by so many pixels; negative: narrowed; -100..100").Default();
  command.Add("--min-part-px", clean.min_part_px, "Parts of fewer pixels are removed, >= 0").Default();
  command.Add("--min-radius-px", clean.min_radius_px, "Parts that hold no circle of this radius are removed, 0..100")
      .Default();
  command.Add("--min-hole-px", clean.min_hole_px, "Holes of fewer pixels are filled, >= 0").Default();
}

ProxyTarget Named(const char* name) { return {.scene = {}, .name = name, .output = {}}; }

// What all commands take.
struct Requests {
  std::optional<Part> part;  // --shard
  AutoOptions choice;
  ProxyTarget plane_target = Named("plane"), delaunay_target = Named("delaunay"), planes_target = Named("planes"),
              moving_target = Named("moving"), dense_target = Named("dense"), box_target = Named("box"),
              hull_target = Named("hull"), simplify_target, import_target = Named("imported");
  double merge_px = DelaunayOptions().merge_px;
  PlanesRequest planes;
  DenseTradeoffRequest dense;
  bool dense_tradeoff = false;
  MovingRequest moving;
  int sides = 6;
  HullRequest hull_request;
  bool hull_tradeoff = false, simplify_table = false;
  SimplifyRequest simplify_request;
  SimplifyTradeoffRequest simplify_tradeoff;
  std::filesystem::path silhouette_scene, silhouette_output;
  SilhouetteSource source;
  CleanOptions source_clean{.min_radius_px = 4};
  std::vector<double> colour, box;
  ImportRequest imported;
  std::string align = "none";
  std::filesystem::path info_scene;
  std::string which;
};

void AddPart(Options& command, std::optional<Part>& part, const std::string& what) {
  command.Call(
      "--shard", [&part](const std::string& text) { part = PartFrom(text); }, what);
}

void AddAuto(Program& program, Requests& r) {
  Options automatic = program.Command(
      "auto", "Builds the proxies that the data allow, keeps as active the one with the smallest held-out error",
      [&]() -> Answer {
        if (r.part) return RunAutoPart(r.choice, *r.part, program.progress());
        return RunAuto(r.choice, program.progress());
      });
  automatic.Add("scene", r.choice.scene, "Scene folder").Required();
  automatic.Add("--choose-width", r.choice.choose_width_px, "Width of the pictures compared, in pixels, >= 16")
      .Default();
  automatic.Add("--holdout", r.choice.holdout, "Every N-th photo is left out, N >= 2; chosen on N/2, N/2+N ...")
      .Default();
  automatic.Add("--budget-ms", r.choice.budget_ms,
                "The best within so many milliseconds a frame of that width, > 0; default: the best");
  automatic.Add("--proxy-minutes", r.choice.proxy_minutes,
                "For depth maps of all photos, whose size follows from it and the machine, >= 0; 0: none; default: "
                "the size follows from the photos' number: 640 pixels up to 120, 480 up to 213, 320 up to 1,000");
  automatic.Add(
      "--depth-width", r.choice.depth_width_px,
      "Longer side of the depth maps in pixels, 64..8192, instead of what follows from the photos or --proxy-minutes");
  AddPart(automatic, r.part,
          "Only part i of n (i from 0) of the depth maps that dense proxies are measured by, without --proxy-minutes; "
          "a run without --shard joins them");
  automatic
      .Add(
          "--candidates", r.choice.candidates,
          "Of plane, planes, box, delaunay, dense, dense-strict, moving, hull, hull-500 and the proxies that the scene "
          "has; default: all that "
          "can be made")
      .Commas();
}

// From cameras and points.
void AddPointProxies(Program& program, Requests& r) {
  Options plane = program.Command("plane", "A plane that faces the views at the robust depth of the points", [&] {
    return MadeFor(r.plane_target, program.progress(),
                   [&](const ProxyTarget& t) { return RunPlane(t, program.progress()); });
  });
  AddTarget(plane, r.plane_target, false);
  AddLeaveOut(plane, r.plane_target);

  Options delaunay =
      program.Command("delaunay", "A closed mesh through the points that agrees with what each camera saw", [&] {
        return MadeFor(r.delaunay_target, program.progress(),
                       [&](const ProxyTarget& t) { return RunDelaunay(t, r.merge_px, program.progress()); });
      });
  AddTarget(delaunay, r.delaunay_target, true);
  AddLeaveOut(delaunay, r.delaunay_target);
  delaunay.Add("--merge-px", r.merge_px, "Points nearer than this in the finest view become one, in pixels, >= 0")
      .Default();

  Options several = program.Command(
      "planes", "A few planes found in the points, cut where they meet, or planes and quads given", [&] {
        return MadeFor(r.planes_target, program.progress(),
                       [&](const ProxyTarget& t) { return RunPlanes(t, r.planes, program.progress()); });
      });
  AddTarget(several, r.planes_target, true);
  AddLeaveOut(several, r.planes_target);
  several.Add("--max-planes", r.planes.planes.max_planes, "How many at most, 1 to 100").Default();
  several
      .Add("--tolerance", r.planes.planes.tolerance,
           "Distance at which a point is on a plane, of the median depth, (0, 0.5]")
      .Default();
  several.Add("--min-share", r.planes.planes.min_share, "Share of the points that makes a plane, (0, 1]").Default();
  several.Flag("!--no-backdrop", r.planes.planes.backdrop,
               "Nothing behind the planes, even where they leave the views' rays empty");
  several.Add("--seed", r.planes.planes.seed, "Of the random samples").Default();
  several.Add("--from", r.planes.from, "JSON of quads and planes to take instead (docs/proxy.md)");

  Options moves = program.Command("moving",
                                  "A surface for what is masked because it moves, where photos of one moment agree, "
                                  "before a proxy of what stands still",
                                  [&] { return RunMoving(r.moving_target, r.moving, program.progress()); });
  AddTarget(moves, r.moving_target, true);
  moves.Add("--over", r.moving.over, "The proxy of what stands still; delaunay is made where it is not there")
      .Default();
  moves.Add("--moments", r.moving.moving.moments, "Compared at most, spread over the period, >= 1").Default();
  moves.Add("--grid", r.moving.moving.grid, "Depths along the longer side of what moves: detail against time, >= 8")
      .Default();
  moves
      .Add("--smoothness", r.moving.moving.smoothness,
           "Between neighbouring depths, in squared code values a plane, >= 0")
      .Default();

  Options tube =
      program.Command("box", "A rectangular tube around the cameras' path and the points, as of a hallway", [&] {
        return MadeFor(r.box_target, program.progress(),
                       [&](const ProxyTarget& t) { return RunBox(t, r.sides, program.progress()); });
      });
  AddTarget(tube, r.box_target, true);
  AddLeaveOut(tube, r.box_target);
  tube.Add("--sides", r.sides, "6: closed; 5: open behind the cameras; 4: open at both ends").Default();
}

// From the photos' pixels, cameras and points.
void AddDense(Program& program, Requests& r) {
  DenseRequest& d = r.dense.dense;
  Options dense =
      program.Command("dense", "A closed mesh through depth maps of all photos (PatchMatch stereo)", [&]() -> Answer {
        if (r.part && r.dense_tradeoff) throw UsageError("--shard and --tradeoff exclude each other");
        if (r.dense_tradeoff) return RunDenseTradeoff(r.dense_target, r.dense, program.progress());
        if (r.part) return RunDensePart(r.dense_target, d, *r.part, program.progress());
        if (d.depth_only) return RunDenseDepths(r.dense_target, d, program.progress());
        return MadeFor(r.dense_target, program.progress(),
                       [&](const ProxyTarget& t) { return RunDense(t, d, program.progress()); });
      });
  AddTarget(dense, r.dense_target, true);
  dense.Add("--width", d.dense.stereo.width, "Longer side of the depth maps in pixels, 64..8192: detail against time")
      .Default();
  dense.Add("--views", d.dense.stereo.views, "Photos that each is compared with, 1..16").Default();
  dense.Add("--iterations", d.dense.stereo.iterations, "Of the first round at half the size, 1..32; later ones follow")
      .Default();
  dense.Add("--agree", d.dense.fusion.agree, "Other photos that must agree on a point, 1..15: more is stricter")
      .Default();
  dense.Add("--merge-px", d.dense.merge_px, "Points nearer than this in the finest map become one, in pixels, > 0")
      .Default();
  dense
      .Add("--faces", d.dense.faces,
           "Of the mesh, >= 1000: those go that the photos show least of; 0: all are kept, two a point or so")
      .Default();
  dense.Add("--memory-mb", d.dense.stereo.memory_mb, "Of depth maps kept in memory; the others wait on disk, >= 64")
      .Default();
  dense.Add("--seed", d.seed, "Of the planes that are tried").Default();
  AddLeaveOut(dense, r.dense_target);
  dense.Add("--from-depth", d.from_depth,
            "Folder with depth_maps/ as COLMAP writes them (DENSE/stereo), instead of our own");
  AddPart(dense, r.part,
          "Only part i of n (i from 0) of the depth maps, as far as they do not wait for other parts'; after at most "
          "four runs of all parts, in any order, a run without --shard makes the mesh (docs/cluster.md)");
  dense.Flag("--depth-only", d.depth_only,
             "Only the maps, as COLMAP has them, in SCENE/stereo or the folder --output: no mesh");
  dense.Flag("--tradeoff", r.dense_tradeoff,
             "Width, views, iterations, agreement and merging against held-out error and seconds, instead of a proxy: "
             "table, and dense.json, .csv, .svg in SCENE/tradeoff or the folder --output");
  dense
      .Add("--holdout", r.dense.holdout,
           "With --tradeoff: every N-th photo is left out, N >= 2; measured on N/2, N/2+N ...")
      .Default();
  dense
      .Add("--choose-width", r.dense.choose_width_px,
           "With --tradeoff: width of the pictures compared, in pixels, >= 16")
      .Default();
}

// From silhouettes.
void AddHulls(Program& program, Requests& r) {
  Options hull = program.Command(
      "hull", "The visual hull of the object's silhouettes: closed, covers every silhouette used", [&]() -> Answer {
        if (!r.hull_tradeoff) return RunHull(r.hull_request, r.hull_target, program.progress());
        return RunHullTradeoff(r.hull_request, r.hull_target.scene, r.hull_target.output, program.progress());
      });
  AddTarget(hull, r.hull_target, true);
  hull.Add("--silhouettes", r.hull_request.silhouettes,
           "Folder of silhouettes, white = object; default: SCENE/silhouettes");
  hull.Add("--cell-px", r.hull_request.hull.cell_px,
           "Edge of the grid's cells in pixels of the finest view: detail against time, > 0")
      .Default();
  hull.Add("--dilate-px", r.hull_request.hull.dilation_px,
           "Widen every silhouette by so many pixels, 0..40; default: the least at which they agree");
  hull.Add("--max-dilation-px", r.hull_request.hull.max_dilation_px,
           "Silhouettes that would need more do not agree and are left out, in pixels, 0..40")
      .Default();
  hull.Flag("--keep-all-views", r.hull_request.hull.keep_all_views, "Leave no view out, though silhouettes disagree");
  hull.Add("--max-mended", r.hull_request.hull.max_mended,
           "Share of a silhouette that may be added where it alone lacks what others show, 0..1; 0: mend none")
      .Default();
  hull.Call(
          "--prefer",
          [&r](const std::string& text) {
            r.hull_request.hull.prefer = text == "tight" ? HullPreference::kTight : HullPreference::kCover;
          },
          "Where silhouettes disagree a little: cover them all, or be tight, their plain intersection where outlines "
          "and "
          "silhouettes have most in common")
      .OneOf({"cover", "tight"})
      .Default("cover");
  hull.Add("--max-left-out", r.hull_request.hull.max_left_out,
           "Share of the views, 0..1: where more disagree, the silhouettes are refused")
      .Default();
  hull.Add("--max-minutes", r.hull_request.hull.max_minutes,
           "Give up after so many minutes, asked between the steps; 0 = never")
      .Default();
  hull.Flag("--tradeoff", r.hull_tradeoff,
            "Views, silhouette size and cells against tightness and seconds, instead of a proxy: table, and hull.json, "
            ".csv, .svg in SCENE/tradeoff or the folder --output");
  AddClean(hull, r.hull_request.clean);

  Options simplify = program.Command(
      "simplify", "The same shape with fewer faces, nearest to the surface or (--keep-hull) enclosing it",
      [&]() -> Answer {
        if (!r.simplify_table) return RunSimplify(r.simplify_request, r.simplify_target, program.progress());
        r.simplify_tradeoff.scene = r.simplify_target.scene;
        r.simplify_tradeoff.from = r.simplify_request.from;
        r.simplify_tradeoff.silhouettes = r.simplify_request.silhouettes;
        return RunSimplifyTradeoff(r.simplify_tradeoff, program.progress());
      });
  AddTarget(simplify, r.simplify_target, false);
  simplify.Add("--faces", r.simplify_request.faces, "Faces wanted, >= 1; 4 for a closed mesh").Default();
  simplify.Add("--from", r.simplify_request.from, "The proxy that is simplified; default: the active one");
  simplify.Add("--name", r.simplify_target.name,
               "Name of the new proxy; default: FROM-FACES, or FROM-FACES-kept with --keep-hull");
  simplify.Flag("--keep-hull", r.simplify_request.keep_hull,
                "Every silhouette of it covers that of the former, which must be closed");
  simplify.Flag("--in-pixels", r.simplify_request.in_pixels,
                "Distances and areas count as the photos show them: more faces for what is near, few for the backdrop. "
                "Where separate parts need too many faces, the smallest go");
  simplify.Add("--silhouettes", r.simplify_request.silhouettes,
               "Folder of silhouettes to measure it against; default: those that its source was made from, else "
               "SCENE/silhouettes");
  simplify.Flag("--tradeoff", r.simplify_table,
                "A table of faces against error against time instead, kept in SCENE/tradeoff");
  simplify
      .Add("--holdout", r.simplify_tradeoff.holdout,
           "With --tradeoff: every N-th photo is left out, N >= 2; measured on N/2, N/2+N ...")
      .Default();
  simplify
      .Add("--choose-width", r.simplify_tradeoff.width_px,
           "With --tradeoff: width of the pictures compared, in pixels, >= 16")
      .Default();
  simplify.Add("--table-faces", r.simplify_tradeoff.faces, "With --tradeoff: the numbers of faces").Default();

  Options silhouettes =
      program.Command("silhouettes", "Which pixels show the object, written to SCENE/silhouettes", [&] {
        if (!r.colour.empty()) r.source.colour = Eigen::Vector3d(r.colour[0], r.colour[1], r.colour[2]);
        if (!r.box.empty()) r.source.box_px = Eigen::Vector4d(r.box[0], r.box[1], r.box[2], r.box[3]);
        return RunSilhouettes(r.silhouette_scene, r.source, r.source_clean, r.silhouette_output, program.progress());
      });
  silhouettes.Add("scene", r.silhouette_scene, "Scene folder").Required();
  silhouettes.Add("-o,--output", r.silhouette_output, "Folder to write to instead");
  silhouettes.Add("--rule", r.source.rule,
                  "On R G B (0..255), H (degrees), S V (0..1), L, X Y (pixels): \"(B - R) < 25 && R + G + B > 60\"");
  silhouettes.Add("--background", r.source.background,
                  "A photo of the background, or a folder with one for each photo");
  silhouettes.Add("--background-colour", r.colour, "R G B of the background, 0..255").Values(3);
  silhouettes.Flag("--background-border", r.source.border_colour,
                   "The background's colour is the median of each photo's border");
  silhouettes
      .Add("--threshold", r.source.threshold, "Colours farther than this from the background's are the object, 0..442")
      .Default();
  silhouettes.Flag("--alpha", r.source.alpha, "The photos' own transparency");
  silhouettes.Add("--masks", r.source.masks, "Folder of masks, white = object");
  silhouettes.Flag(
      "--undistort", r.source.undistort,
      "Masks and backgrounds are of the photos as they were taken: undistorted as the scene's photos were");
  silhouettes.Add("--box", r.box, "Left top right bottom in pixels, around the object in every photo: GrabCut")
      .Values(4);
  AddClean(silhouettes, r.source_clean);
}

void AddImportAndInfo(Program& program, Requests& r) {
  Options import = program.Command("import", "A mesh made elsewhere (PLY, OBJ), in the scene's frame", [&] {
    r.imported.icp = r.align == "icp";
    return RunImport(r.imported, r.import_target, program.progress());
  });
  import.Add("file", r.imported.file, "Mesh file").Required();
  import.Add("--scale", r.imported.scale, "Factor on its coordinates, > 0").Default();
  import.Add("--unit", r.imported.unit,
             "Of its coordinates, where the scene's is the metre: um, mm, cm, dm, m, km, in, ft");
  import.Add("--axes", r.imported.axes,
             "Its axis that is up in the scene (y-up, z-up, -y-up ...), or the scene's x,y,z in its axes: x,-z,y");
  import.Add("--correspond", r.imported.correspond,
             "JSON or CSV of points of the file and of the scene, three pairs or more, instead of the three above");
  import.Add("--align", r.align, "icp: from there moved, turned and scaled onto the scene's points")
      .OneOf({"none", "icp"})
      .Default();
  import.Flag("!--no-repair", r.imported.repair, "Refuse a mesh that is not sound instead of mending it");
  AddTarget(import, r.import_target, true);

  Options info = program.Command("info", "The proxies of a scene: faces, coverage of the views, fit to the points",
                                 [&] { return RunInfo(r.info_scene, r.which, program.progress()); });
  info.Add("scene", r.info_scene, "Scene folder").Required();
  info.Add("--name", r.which, "One proxy; default: all");
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  using namespace lumi;
  Program program("lumi-proxy", "Makes the geometric proxy of a scene: a plane, or a mesh through its points");
  program.options().RequireCommand();
  Requests requests;
  AddAuto(program, requests);
  AddPointProxies(program, requests);
  AddDense(program, requests);
  AddHulls(program, requests);
  AddImportAndInfo(program, requests);
  program.options().Examples(
      "lumi-proxy auto scene                       makes several, and keeps the best on left-out photos\n"
      "lumi-proxy delaunay scene                   a closed mesh through the points\n"
      "lumi-proxy dense scene                      a mesh through depth maps of all photos\n"
      "lumi-proxy import scan.ply scene --unit mm  a mesh made elsewhere\n"
      "lumi-proxy info scene");
  program.RunAndExit(argc, argv);
}
