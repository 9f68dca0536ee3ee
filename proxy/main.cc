// lumi-proxy: the rough geometry that a lumigraph's photographs are blended over.
#include "proxy/commands.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "scene/program/main_program.h"

namespace {

void AddTarget(lumi::Options& command, lumi::ProxyTarget& target, bool named) {
  command.Add("scene", target.scene, "Scene folder (or with --output: COLMAP workspace, transforms.json)").Required();
  if (named) command.Add("--name", target.name, "Name of the proxy in the scene").Default();
  command.Add("-o,--output", target.output, "Write this .ply or .obj file instead, nothing into the scene");
  command.Flag("--activate", target.activate, "Make it the scene's active proxy even where there is one");
}

void AddClean(lumi::Options& command, lumi::CleanOptions& clean) {
  command.Add("--close-px", clean.close_px, "Gaps about twice as wide are bridged, in pixels, 0..100").Default();
  command.Add("--grow-px", clean.grow_px, "Widened by so many pixels; negative: narrowed; -100..100").Default();
  command.Add("--min-part-px", clean.min_part_px, "Parts of fewer pixels are removed, >= 0").Default();
  command.Add("--min-radius-px", clean.min_radius_px, "Parts that hold no circle of this radius are removed, 0..100")
      .Default();
  command.Add("--min-hole-px", clean.min_hole_px, "Holes of fewer pixels are filled, >= 0").Default();
}

lumi::ProxyTarget Named(const char* name) { return {.scene = {}, .name = name, .output = {}}; }

}  // namespace

int main(int argc, char** argv) {
  using namespace lumi;
  Program program("lumi-proxy", "Makes the geometric proxy of a scene: a plane, or a mesh through its points");
  program.options().RequireCommand();

  AutoOptions choice;
  Options automatic = program.Command(
      "auto", "Builds the proxies that the data allow, keeps as active the one with the smallest held-out error",
      [&] { return RunAuto(choice, program.progress()); });
  automatic.Add("scene", choice.scene, "Scene folder").Required();
  automatic.Add("--choose-width", choice.choose_width_px, "Width of the pictures compared, in pixels, >= 16").Default();
  automatic.Add("--holdout", choice.holdout, "Every N-th photo is left out, N >= 2; chosen on N/2, N/2+N ...")
      .Default();
  automatic.Add("--budget-ms", choice.budget_ms,
                "The best within so many milliseconds a frame of that width, > 0; default: the best");
  automatic
      .Add("--candidates", choice.candidates,
           "Of plane, planes, box, mesh, moving, hull, hull-500 and the proxies that the scene has; default: all that "
           "can be made")
      .Commas();

  ProxyTarget plane_target = Named("plane");
  Options plane = program.Command("plane", "A plane that faces the views at the robust depth of the points",
                                  [&] { return RunPlane(plane_target, program.progress()); });
  AddTarget(plane, plane_target, false);

  double merge_px = DelaunayOptions().merge_px;
  ProxyTarget mesh_target = Named("mesh");
  Options delaunay =
      program.Command("delaunay", "A closed mesh through the points that agrees with what each camera saw",
                      [&] { return RunDelaunay(mesh_target, merge_px, program.progress()); });
  AddTarget(delaunay, mesh_target, true);
  delaunay.Add("--merge-px", merge_px, "Points nearer than this in the finest view become one, in pixels, >= 0")
      .Default();

  PlanesRequest planes;
  ProxyTarget planes_target = Named("planes");
  Options several =
      program.Command("planes", "A few planes found in the points, cut where they meet, or planes and quads given",
                      [&] { return RunPlanes(planes_target, planes, program.progress()); });
  AddTarget(several, planes_target, true);
  several.Add("--max-planes", planes.planes.max_planes, "How many at most, 1 to 100").Default();
  several
      .Add("--tolerance", planes.planes.tolerance,
           "Distance at which a point is on a plane, of the median depth, (0, 0.5]")
      .Default();
  several.Add("--min-share", planes.planes.min_share, "Share of the points that makes a plane, (0, 1]").Default();
  several.Flag("!--no-backdrop", planes.planes.backdrop,
               "Nothing behind the planes, even where they leave the views' rays empty");
  several.Add("--seed", planes.planes.seed, "Of the random samples").Default();
  several.Add("--from", planes.from, "JSON of quads and planes to take instead (docs/proxy.md)");

  MovingRequest moving;
  ProxyTarget moving_target = Named("moving");
  Options moves = program.Command("moving",
                                  "A surface for what is masked because it moves, where photos of one moment agree, "
                                  "before a proxy of what stands still",
                                  [&] { return RunMoving(moving_target, moving, program.progress()); });
  AddTarget(moves, moving_target, true);
  moves.Add("--over", moving.over, "The proxy of what stands still; mesh is made where it is not there").Default();
  moves.Add("--moments", moving.moving.moments, "Compared at most, spread over the period, >= 1").Default();
  moves.Add("--grid", moving.moving.grid, "Depths along the longer side of what moves: detail against time, >= 8")
      .Default();
  moves
      .Add("--smoothness", moving.moving.smoothness,
           "Between neighbouring depths, in squared code values a plane, >= 0")
      .Default();

  int sides = 6;
  ProxyTarget box_target = Named("box");
  Options tube = program.Command("box", "A rectangular tube around the cameras' path and the points, as of a hallway",
                                 [&] { return RunBox(box_target, sides, program.progress()); });
  AddTarget(tube, box_target, true);
  tube.Add("--sides", sides, "6: closed; 5: open behind the cameras; 4: open at both ends").Default();

  ProxyTarget hull_target = Named("hull");
  HullRequest hull_request;
  bool hull_tradeoff = false;
  Options hull = program.Command(
      "hull", "The visual hull of the object's silhouettes: closed, covers every silhouette used", [&]() -> Answer {
        if (!hull_tradeoff) return RunHull(hull_request, hull_target, program.progress());
        return RunHullTradeoff(hull_request, hull_target.scene, hull_target.output, program.progress());
      });
  AddTarget(hull, hull_target, true);
  hull.Add("--silhouettes", hull_request.silhouettes,
           "Folder of silhouettes, white = object; default: SCENE/silhouettes");
  hull.Add("--cell-px", hull_request.hull.cell_px,
           "Edge of the grid's cells in pixels of the finest view: detail against time, > 0")
      .Default();
  hull.Add("--dilate-px", hull_request.hull.dilation_px,
           "Widen every silhouette by so many pixels, 0..40; default: the least at which they agree");
  hull.Add("--max-dilation-px", hull_request.hull.max_dilation_px,
           "Silhouettes that would need more do not agree and are left out, in pixels, 0..40")
      .Default();
  hull.Flag("--keep-all-views", hull_request.hull.keep_all_views, "Leave no view out, though silhouettes disagree");
  hull.Add("--max-mended", hull_request.hull.max_mended,
           "Share of a silhouette that may be added where it alone lacks what others show, 0..1; 0: mend none")
      .Default();
  hull.Flag("--tradeoff", hull_tradeoff,
            "Views, silhouette size and cells against tightness and seconds, instead of a proxy: table, and hull.json, "
            ".csv, .svg in SCENE/tradeoff or the folder --output");
  AddClean(hull, hull_request.clean);

  ProxyTarget simplify_target;
  SimplifyRequest simplify_request;
  SimplifyTradeoffRequest simplify_tradeoff;
  bool simplify_table = false;
  Options simplify = program.Command(
      "simplify", "The same shape with fewer faces, nearest to the surface or (--keep-hull) enclosing it",
      [&]() -> Answer {
        if (!simplify_table) return RunSimplify(simplify_request, simplify_target, program.progress());
        simplify_tradeoff.scene = simplify_target.scene;
        simplify_tradeoff.from = simplify_request.from;
        simplify_tradeoff.silhouettes = simplify_request.silhouettes;
        return RunSimplifyTradeoff(simplify_tradeoff, program.progress());
      });
  AddTarget(simplify, simplify_target, false);
  simplify.Add("--faces", simplify_request.faces, "Faces wanted, >= 1; 4 for a closed mesh").Default();
  simplify.Add("--from", simplify_request.from, "The proxy that is simplified; default: the active one");
  simplify.Add("--name", simplify_target.name,
               "Name of the new proxy; default: FROM-FACES, or FROM-FACES-kept with --keep-hull");
  simplify.Flag("--keep-hull", simplify_request.keep_hull,
                "Every silhouette of it covers that of the former, which must be closed");
  simplify.Add("--silhouettes", simplify_request.silhouettes,
               "Folder of silhouettes to measure it against; default: SCENE/silhouettes");
  simplify.Flag("--tradeoff", simplify_table,
                "A table of faces against error against time instead, kept in SCENE/tradeoff");
  simplify
      .Add("--holdout", simplify_tradeoff.holdout,
           "With --tradeoff: every N-th photo is left out, N >= 2; measured on N/2, N/2+N ...")
      .Default();
  simplify
      .Add("--choose-width", simplify_tradeoff.width_px,
           "With --tradeoff: width of the pictures compared, in pixels, >= 16")
      .Default();
  simplify.Add("--table-faces", simplify_tradeoff.faces, "With --tradeoff: the numbers of faces").Default();

  std::filesystem::path silhouette_scene, silhouette_output;
  SilhouetteSource source;
  CleanOptions source_clean{.min_radius_px = 4};
  std::vector<double> colour, box;
  Options silhouettes =
      program.Command("silhouettes", "Which pixels show the object, written to SCENE/silhouettes", [&] {
        if (!colour.empty()) source.colour = Eigen::Vector3d(colour[0], colour[1], colour[2]);
        if (!box.empty()) source.box_px = Eigen::Vector4d(box[0], box[1], box[2], box[3]);
        return RunSilhouettes(silhouette_scene, source, source_clean, silhouette_output, program.progress());
      });
  silhouettes.Add("scene", silhouette_scene, "Scene folder").Required();
  silhouettes.Add("-o,--output", silhouette_output, "Folder to write to instead");
  silhouettes.Add("--rule", source.rule,
                  "On R G B (0..255), H (degrees), S V (0..1), L, X Y (pixels): \"(B - R) < 25 && R + G + B > 60\"");
  silhouettes.Add("--background", source.background, "A photo of the background, or a folder with one for each photo");
  silhouettes.Add("--background-colour", colour, "R G B of the background, 0..255").Values(3);
  silhouettes.Flag("--background-border", source.border_colour,
                   "The background's colour is the median of each photo's border");
  silhouettes
      .Add("--threshold", source.threshold, "Colours farther than this from the background's are the object, 0..442")
      .Default();
  silhouettes.Flag("--alpha", source.alpha, "The photos' own transparency");
  silhouettes.Add("--masks", source.masks, "Folder of masks, white = object");
  silhouettes.Add("--box", box, "Left top right bottom in pixels, around the object in every photo: GrabCut").Values(4);
  AddClean(silhouettes, source_clean);

  ImportRequest imported;
  ProxyTarget import_target = Named("imported");
  std::string align = "none";
  Options import = program.Command("import", "A mesh made elsewhere (PLY, OBJ), in the scene's frame", [&] {
    imported.icp = align == "icp";
    return RunImport(imported, import_target, program.progress());
  });
  import.Add("file", imported.file, "Mesh file").Required();
  import.Add("--scale", imported.scale, "Factor on its coordinates, > 0").Default();
  import.Add("--unit", imported.unit,
             "Of its coordinates, where the scene's is the metre: um, mm, cm, dm, m, km, in, ft");
  import.Add("--axes", imported.axes,
             "Its axis that is up in the scene (y-up, z-up, -y-up ...), or the scene's x,y,z in its axes: x,-z,y");
  import.Add("--correspond", imported.correspond,
             "JSON or CSV of points of the file and of the scene, three pairs or more, instead of the three above");
  import.Add("--align", align, "icp: from there moved, turned and scaled onto the scene's points")
      .OneOf({"none", "icp"})
      .Default();
  import.Flag("!--no-repair", imported.repair, "Refuse a mesh that is not sound instead of mending it");
  AddTarget(import, import_target, true);

  std::filesystem::path scene;
  std::string which;
  Options info = program.Command("info", "The proxies of a scene: faces, coverage of the views, fit to the points",
                                 [&] { return RunInfo(scene, which, program.progress()); });
  info.Add("scene", scene, "Scene folder").Required();
  info.Add("--name", which, "One proxy; default: all");
  return program.Run(argc, argv);
}
