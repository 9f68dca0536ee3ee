// lumi-proxy: the rough geometry that a lumigraph's photographs are blended over.
#include "proxy/commands.h"
#include "proxy/delaunay/delaunay_proxy.h"
#include "scene/program/main_program.h"

int main(int argc, char** argv) {
  lumi::Program program("lumi-proxy", "Makes the geometric proxy of a scene: a plane, or a mesh through its points");
  CLI::App& app = program.app();
  app.require_subcommand(1);
  std::function<std::string()> run;
  std::string table;  // what a person reads of a trade-off

  lumi::AutoOptions choice;
  CLI::App* automatic = app.add_subcommand("auto", "Builds the proxies that the data allow, keeps as active the one with the smallest held-out error");
  automatic->add_option("scene", choice.scene, "Scene folder")->required();
  automatic->add_option("--choose-width", choice.choose_width_px, "Width of the pictures compared, in pixels, >= 16")->capture_default_str();
  automatic->add_option("--holdout", choice.holdout, "Every N-th photo is left out, N >= 2; chosen on N/2, N/2+N ...")->capture_default_str();
  double budget_ms = 0;
  CLI::Option* budget = automatic->add_option("--budget-ms", budget_ms, "The best within so many milliseconds a frame of that width, > 0; default: the best");
  automatic->add_option("--candidates", choice.candidates, "Of plane, planes, box, mesh, moving, hull, hull-500 and the proxies that the scene has; default: all that can be made")->delimiter(',');
  automatic->callback([&] {
    if (*budget) choice.budget_ms = budget_ms;
    run = [&] { return lumi::RunAuto(choice, program.progress()); };
  });

  const auto add_target = [](CLI::App* command, lumi::ProxyTarget& target, bool named) {
    command->add_option("scene", target.scene, "Scene folder (or with --output: COLMAP workspace, transforms.json)")->required();
    if (named) command->add_option("--name", target.name, "Name of the proxy in the scene")->capture_default_str();
    command->add_option("-o,--output", target.output, "Write this .ply or .obj file instead, nothing into the scene");
    command->add_flag("--activate", target.activate, "Make it the scene's active proxy even where there is one");
  };
  CLI::App* plane = app.add_subcommand("plane", "A plane that faces the views at the robust depth of the points");
  lumi::ProxyTarget plane_target{.scene = {}, .name = "plane", .output = {}};
  add_target(plane, plane_target, false);
  plane->callback([&] { run = [&] { return lumi::RunPlane(plane_target, program.progress()); }; });

  double merge_px = lumi::DelaunayOptions().merge_px;
  CLI::App* delaunay = app.add_subcommand("delaunay", "A closed mesh through the points that agrees with what each camera saw");
  lumi::ProxyTarget mesh_target{.scene = {}, .name = "mesh", .output = {}};
  add_target(delaunay, mesh_target, true);
  delaunay->add_option("--merge-px", merge_px, "Points nearer than this in the finest view become one, in pixels, >= 0")->capture_default_str();
  delaunay->callback([&] { run = [&] { return lumi::RunDelaunay(mesh_target, merge_px, program.progress()); }; });

  lumi::PlanesRequest planes;
  CLI::App* several = app.add_subcommand("planes", "A few planes found in the points, cut where they meet, or planes and quads given");
  lumi::ProxyTarget planes_target{.scene = {}, .name = "planes", .output = {}};
  add_target(several, planes_target, true);
  several->add_option("--max-planes", planes.max_planes, "How many at most, 1 to 100")->capture_default_str();
  several->add_option("--tolerance", planes.tolerance, "Distance at which a point is on a plane, of the median depth, (0, 0.5]")->capture_default_str();
  several->add_option("--min-share", planes.min_share, "Share of the points that makes a plane, (0, 1]")->capture_default_str();
  several->add_flag("!--no-backdrop", planes.backdrop, "Nothing behind the planes, even where they leave the views' rays empty");
  several->add_option("--seed", planes.seed, "Of the random samples")->capture_default_str();
  several->add_option("--from", planes.from, "JSON of quads and planes to take instead (docs/proxy.md)");
  several->callback([&] { run = [&] { return lumi::RunPlanes(planes_target, planes, program.progress()); }; });

  lumi::MovingRequest moving;
  CLI::App* moves = app.add_subcommand("moving", "A surface for what is masked because it moves, where photos of one moment agree, before a proxy of what stands still");
  lumi::ProxyTarget moving_target{.scene = {}, .name = "moving", .output = {}};
  add_target(moves, moving_target, true);
  moves->add_option("--over", moving.over, "The proxy of what stands still; mesh is made where it is not there")->capture_default_str();
  moves->add_option("--moments", moving.moments, "Compared at most, spread over the period, >= 1")->capture_default_str();
  moves->add_option("--grid", moving.grid, "Depths along the longer side of what moves: detail against time, >= 8")->capture_default_str();
  moves->add_option("--smoothness", moving.smoothness, "Between neighbouring depths, in squared code values a plane, >= 0")->capture_default_str();
  moves->callback([&] { run = [&] { return lumi::RunMoving(moving_target, moving, program.progress()); }; });

  int sides = 6;
  CLI::App* tube = app.add_subcommand("box", "A rectangular tube around the cameras' path and the points, as of a hallway");
  lumi::ProxyTarget box_target{.scene = {}, .name = "box", .output = {}};
  add_target(tube, box_target, true);
  tube->add_option("--sides", sides, "6: closed; 5: open behind the cameras; 4: open at both ends")->capture_default_str();
  tube->callback([&] { run = [&] { return lumi::RunBox(box_target, sides, program.progress()); }; });

  const auto add_clean = [](CLI::App* command, lumi::CleanOptions& clean) {
    command->add_option("--close-px", clean.close_px, "Gaps about twice as wide are bridged, in pixels, 0..100")->capture_default_str();
    command->add_option("--grow-px", clean.grow_px, "Widened by so many pixels; negative: narrowed; -100..100")->capture_default_str();
    command->add_option("--min-part-px", clean.min_part_px, "Parts of fewer pixels are removed, >= 0")->capture_default_str();
    command->add_option("--min-radius-px", clean.min_radius_px, "Parts that hold no circle of this radius are removed, 0..100")->capture_default_str();
    command->add_option("--min-hole-px", clean.min_hole_px, "Holes of fewer pixels are filled, >= 0")->capture_default_str();
  };
  CLI::App* hull = app.add_subcommand("hull", "The visual hull of the object's silhouettes: closed, covers every silhouette used");
  lumi::ProxyTarget hull_target{.scene = {}, .name = "hull", .output = {}};
  lumi::HullRequest hull_request;
  double dilation_px = 0;
  bool hull_tradeoff = false;
  add_target(hull, hull_target, true);
  hull->add_option("--silhouettes", hull_request.silhouettes, "Folder of silhouettes, white = object; default: SCENE/silhouettes");
  hull->add_option("--cell-px", hull_request.hull.cell_px, "Edge of the grid's cells in pixels of the finest view: detail against time, > 0")->capture_default_str();
  CLI::Option* dilate = hull->add_option("--dilate-px", dilation_px, "Widen every silhouette by so many pixels, 0..40; default: the least at which they agree");
  hull->add_option("--max-dilation-px", hull_request.hull.max_dilation_px, "Silhouettes that would need more do not agree and are left out, in pixels, 0..40")->capture_default_str();
  hull->add_flag("--keep-all-views", hull_request.hull.keep_all_views, "Leave no view out, though silhouettes disagree");
  hull->add_option("--max-mended", hull_request.hull.max_mended, "Share of a silhouette that may be added where it alone lacks what others show, 0..1; 0: mend none")->capture_default_str();
  hull->add_flag("--tradeoff", hull_tradeoff, "Views, silhouette size and cells against tightness and seconds, instead of a proxy: table, and hull.json, .csv, .svg in SCENE/tradeoff or the folder --output");
  add_clean(hull, hull_request.clean);
  hull->callback([&] {
    if (dilate->count() > 0) hull_request.hull.dilation_px = dilation_px;
    if (hull_tradeoff) {
      run = [&] {
        const lumi::HullTradeoff tradeoff = lumi::RunHullTradeoff(hull_request, hull_target.scene, hull_target.output, program.progress());
        table = lumi::Describe(tradeoff);
        return lumi::ToJson(tradeoff);
      };
      return;
    }
    run = [&] { return lumi::RunHull(hull_request, hull_target, program.progress()); };
  });

  CLI::App* simplify = app.add_subcommand("simplify", "The same shape with fewer faces, nearest to the surface or (--keep-hull) enclosing it");
  lumi::ProxyTarget simplify_target;
  lumi::SimplifyRequest simplify_request;
  lumi::SimplifyTradeoffRequest simplify_tradeoff;
  bool simplify_table = false;
  add_target(simplify, simplify_target, false);
  simplify->add_option("--faces", simplify_request.faces, "Faces wanted, >= 1; 4 for a closed mesh")->capture_default_str();
  simplify->add_option("--from", simplify_request.from, "The proxy that is simplified; default: the active one");
  simplify->add_option("--name", simplify_target.name, "Name of the new proxy; default: FROM-FACES, or FROM-FACES-kept with --keep-hull");
  simplify->add_flag("--keep-hull", simplify_request.keep_hull, "Every silhouette of it covers that of the former, which must be closed");
  simplify->add_option("--silhouettes", simplify_request.silhouettes, "Folder of silhouettes to measure it against; default: SCENE/silhouettes");
  simplify->add_flag("--tradeoff", simplify_table, "A table of faces against error against time instead, kept in SCENE/tradeoff");
  simplify->add_option("--holdout", simplify_tradeoff.holdout, "With --tradeoff: every N-th photo is left out, N >= 2; measured on N/2, N/2+N ...")->capture_default_str();
  simplify->add_option("--choose-width", simplify_tradeoff.width_px, "With --tradeoff: width of the pictures compared, in pixels, >= 16")->capture_default_str();
  simplify->add_option("--table-faces", simplify_tradeoff.faces, "With --tradeoff: the numbers of faces")->capture_default_str();
  simplify->callback([&] {
    simplify_tradeoff.scene = simplify_target.scene;
    simplify_tradeoff.from = simplify_request.from;
    simplify_tradeoff.silhouettes = simplify_request.silhouettes;
    run = [&] {
      return simplify_table ? lumi::RunSimplifyTradeoff(simplify_tradeoff, program.progress()) : lumi::RunSimplify(simplify_request, simplify_target, program.progress());
    };
  });

  CLI::App* silhouettes = app.add_subcommand("silhouettes", "Which pixels show the object, written to SCENE/silhouettes");
  std::filesystem::path silhouette_scene, silhouette_output;
  lumi::SilhouetteSource source;
  lumi::CleanOptions source_clean{.min_radius_px = 4};
  std::vector<double> colour, box;
  silhouettes->add_option("scene", silhouette_scene, "Scene folder")->required();
  silhouettes->add_option("-o,--output", silhouette_output, "Folder to write to instead");
  silhouettes->add_option("--rule", source.rule, "On R G B (0..255), H (degrees), S V (0..1), L, X Y (pixels): \"(B - R) < 25 && R + G + B > 60\"");
  silhouettes->add_option("--background", source.background, "A photo of the background, or a folder with one for each photo");
  silhouettes->add_option("--background-colour", colour, "R G B of the background, 0..255")->expected(3);
  silhouettes->add_flag("--background-border", source.border_colour, "The background's colour is the median of each photo's border");
  silhouettes->add_option("--threshold", source.threshold, "Colours farther than this from the background's are the object, 0..442")->capture_default_str();
  silhouettes->add_flag("--alpha", source.alpha, "The photos' own transparency");
  silhouettes->add_option("--masks", source.masks, "Folder of masks, white = object");
  silhouettes->add_option("--box", box, "Left top right bottom in pixels, around the object in every photo: GrabCut")->expected(4);
  add_clean(silhouettes, source_clean);
  silhouettes->callback([&] {
    if (!colour.empty()) source.colour = Eigen::Vector3d(colour[0], colour[1], colour[2]);
    if (!box.empty()) source.box_px = Eigen::Vector4d(box[0], box[1], box[2], box[3]);
    run = [&] { return lumi::RunSilhouettes(silhouette_scene, source, source_clean, silhouette_output, program.progress()); };
  });

  lumi::ImportRequest imported;
  CLI::App* import = app.add_subcommand("import", "A mesh made elsewhere (PLY, OBJ), in the scene's frame");
  import->add_option("file", imported.file, "Mesh file")->required();
  import->add_option("--scale", imported.scale, "Factor on its coordinates, > 0")->capture_default_str();
  import->add_option("--unit", imported.unit, "Of its coordinates, where the scene's is the metre: um, mm, cm, dm, m, km, in, ft");
  import->add_option("--axes", imported.axes, "Its axis that is up in the scene (y-up, z-up, -y-up ...), or the scene's x,y,z in its axes: x,-z,y");
  import->add_option("--correspond", imported.correspond, "JSON or CSV of points of the file and of the scene, three pairs or more, instead of the three above");
  std::string align = "none";
  import->add_option("--align", align, "icp: from there moved, turned and scaled onto the scene's points")->check(CLI::IsMember({"none", "icp"}))->capture_default_str();
  import->add_flag("!--no-repair", imported.repair, "Refuse a mesh that is not sound instead of mending it");
  lumi::ProxyTarget import_target{.scene = {}, .name = "imported", .output = {}};
  add_target(import, import_target, true);
  import->callback([&] {
    imported.icp = align == "icp";
    run = [&] { return lumi::RunImport(imported, import_target, program.progress()); };
  });

  std::filesystem::path scene;
  std::string which;
  CLI::App* info = app.add_subcommand("info", "The proxies of a scene: faces, coverage of the views, fit to the points");
  info->add_option("scene", scene, "Scene folder")->required();
  info->add_option("--name", which, "One proxy; default: all");
  info->callback([&] { run = [&] { return lumi::RunInfo(scene, which, program.progress()); }; });

  return program.Run(argc, argv, [&] { return run(); }, [&](const std::string& json) { return table.empty() ? lumi::DescribeProxy(json) : table; });
}
