#include <charconv>

#include "render/commands/render_command.h"
#include "render/commands/settings_line.h"
#include "render/tradeoff/methods.h"
#include "render/tradeoff/tradeoff.h"
#include "scene/files/scene_folder.h"
#include "scene/program/main_program.h"

namespace {

using namespace lumi;

// The options of the command line.
struct Line {
  RenderOptions render;
  MeasureOptions measure;
  MethodsOptions methods;
  TableOptions table;
  std::filesystem::path settings_file;
  std::vector<std::string> pixels;
  bool ablation = false, properties = false, time_windows = false;
};

// A settings file: the options themselves, or a summary that lumi-render printed.
struct SettingsFile {
  std::optional<JsonKeys> settings;
};
void ListKeys(JsonKeys& j, SettingsFile& file) { j("settings", file.settings); }

// Defaults, then the file's own words, then the command line's.
void ApplySettings(const std::filesystem::path& file, const SettingsLine& given, RenderOptions& o) {
  if (!file.empty()) {
    JsonKeys json = JsonKeys::Read(file, "a settings file");
    if (const auto settings = json.As<SettingsFile>().settings) json = *settings;
    try {
      for (const auto& [name, text] : json.Words()) {
        if (name == "backend" && text != "cpu" && text != "gl")
          throw InputError(file, "backend takes cpu or gl, not " + text);
        if (name == "backend") {
          if (!o.decided.Has(name)) o.backend = text;
          continue;
        }
        if (!SetOption(o.settings, name, text))
          throw InputError(file, "\"" + name + "\" is not a setting of the reconstruction");
        o.decided.Add(name);
      }
    } catch (const UsageError& e) {
      throw InputError(file, e.what());
    }
  }
  given.Apply(o.settings, o.decided);
  if (o.phase && given.Has("time-s")) throw UsageError("--phase and --time-s do not go together: both say when");
  // A time that the user names switches the time measure on.
  if ((given.Has("time-s") || o.phase || (o.decided.Has("time-s") && !o.decided.Has("time"))) && !given.Has("time")) {
    o.settings.time = true;
    o.decided.Add("time");
  }
}

std::optional<int> WindowFrames(const std::string& text) {
  if (text.empty()) return std::nullopt;
  if (text == "all") return -1;
  int frames = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), frames);
  if (error != std::errc() || end != text.data() + text.size() || frames < 0 || frames > 1000)
    throw UsageError("takes 0 to 1000, or all; not " + text);
  return frames;
}

void AddRendering(Options app, Line& line) {
  RenderOptions& o = line.render;
  app.Add("scene", o.scene, "Scene folder, COLMAP workspace or transforms.json");
  app.Add("-o,--output", o.output, "Folder for pictures, or FILE.mp4 for a path");
  app.Add("--proxy", o.proxy,
          "Proxy by name; a mesh file (PLY, OBJ); per-view: the points triangulated in each view; default: the scene's "
          "active one");
  app.Add("--path", o.path,
          "Camera path JSON, of poses or (lumi-stabilize) of projection matrices; default: through the photos' own "
          "cameras");
  app.Add("--view", o.view, "Render at this photo's own camera: its name, or else its position from 0");
  app.Flag("--leave-out", o.leave_out, "With --view: without that photo");
  app.Add("--pixel", line.pixels,
          "With --view: X,Y, pixels from the upper left corner; also tells which photos it is blended from, and their "
          "weights; may be given again")
      .OneEach();
  app.Call(
      "--holdout", [&o](const std::string& text) { o.holdout = HoldoutFrom(text); },
      "N >= 2: render photos 0, N, 2N ... from the others and compare; each: every photo in turn, from all others; "
      "auto: "
      "each of fewer than 24 photos, else 8");
  app.Add("--fold", o.fold, "Photos that --holdout N takes: report 0, N ..., choose N/2, N/2+N ...")
      .OneOf({"report", "choose"})
      .Default();
  app.Add("--seen-proxy", o.seen_proxy,
          "With --holdout: the proxy that says which pixels two photos see, so that proxies are compared over the same "
          "ones; default: the one rendered over");
  // 0 stands for "not given" inside; nobody may give it.
  app.Add("--width", o.width_px, "Width in pixels; default: the photo's, or at most 1024 for a path")
      .Range(1, kMaxPictureSide);
  app.Add("--height", o.height_px, "Height in pixels; default: by the path's aspect, else the photos'")
      .Range(1, kMaxPictureSide);
  app.Add("--seconds", o.seconds, "Length of the path through the photos").Default();
  app.Add("--fps", o.fps,
          "Frames a second of that path; with --path of matrices: of its film, each picture the frame nearest in time, "
          "in place of the frames' own times")
      .Default();
  app.Call(
      "--frames", [&o](const std::string& text) { o.frames = FrameRangeFrom(text); },
      "A-B: only these frames of the path, from 0");
  app.Call(
      "--shard", [&o](const std::string& text) { o.shard = PartFrom(text); },
      "i/n: only part i of n of the path's frames. Parts may be made at the same time, on several machines, into one "
      "folder; a run without --shard joins them");
  app.Flag("--video", o.video, "Also write the path as path.mp4 (H.264)");
  app.Add("--format", o.format, "Of the pictures").OneOf({"png", "jpg", "exr"}).Default();
  app.Add("--backend", o.backend, "Where frames are blended").OneOf({"cpu", "gl"}).Default();
  o.memory_mb = 0;
  app.Add("--memory-mb", o.memory_mb,
          "Memory of the whole program, about: photos that do not fit are read as pictures need them (over one "
          "mesh). 0: six tenths of what is free")
      .Range(0, 1 << 24)
      .Default();
  app.Add("--budget-ms", o.budget_ms,
          "Choose settings for this time a frame, > 0: from the scene's measured front, else by a probe; options given "
          "stay");
  app.Add(
      "--fidelity-db", o.fidelity_db,
      "Along a path: sparse samples, of the scene's measured front or candidates, whose frames are at least so near "
      "to a weight at every pixel (PSNR, tried on 3 frames); else a weight at every pixel");
  app.Add("--show", o.show, "What is shown").OneOf(ShowNames()).Default();
  app.Add("--of", o.of, "With --show weights, angle ...: of this photo; default: of the one that weighs most");
  app.Add("--effects", o.effects, EffectsHelp()).Default();
  app.Add("--phase", o.phase, "The view's time as a fraction of the scene's period");
  app.Add("--settings", line.settings_file,
          "JSON object of the reconstruction's options; what stands on the command line wins");
  app.Call(
      "--window-frames", [&o](const std::string& text) { o.window_frames = WindowFrames(text); },
      "Photos to either side in time that a picture may use, 0 to 1000, or all; default: 5 along a path of matrices "
      "and in videos without a metric, else all");
  app.Call(
         "--border", [&o](const std::string& text) { o.border.fill = text == "fill"; },
         "Pixels that no photo sees: black (a hole), or fill: along a path of matrices from photos farther away in "
         "time, "
         "the rest smoothly from around them; alpha still says what photos saw")
      .OneOf({"black", "fill"})
      .Default("black");
  app.Add("--fill-frames", o.border.reach, "With --border fill: photos to either side that are asked")
      .Range(1, 1000)
      .Default();
  app.Add("--nominal-focal-px", o.nominal_focal_px,
          "Focal length that turns vanishing points into angles where the scene has no metric, > 0, pixels of the "
          "picture; default: 1.2 x its longer side")
      .Positive();
  app.Flag("--rescale-cameras", o.rescale_cameras, "Fit cameras to photos of another size instead of refusing them");
}

// The options of the reconstruction go to either side of a measuring command's name.
void AddMeasuring(Options command, MeasureOptions& m) {
  command.Add("scene", m.scene, "Scene folder, COLMAP workspace or transforms.json").Required();
  command.Add("-o,--output", m.output, "Folder for tables, plots and pictures");
  command.Add("--proxy", m.proxies, "Proxies to measure; default: all the scene has, the active one first").OneEach();
  command.Add("--width", m.width_px, "Width of the frames, pixels; default: the photos', at most 1024")
      .Range(1, kMaxPictureSide);
  command
      .Add("--holdout", m.holdout,
           "Every N-th photo is held out; settings are chosen on N/2, N/2+N ... and reported on 0, N ...")
      .Default();
  command.Add("--views", m.views, "Held-out photos that are measured").Default();
  command.Add("--repeats", m.repeats, "Timed frames a view and setting, after a warm-up").Default();
  command.Flag("--quick", m.quick, "Fewer settings, at most 320 pixels wide");
  command.Footer("Options of the reconstruction (see lumi-render --help-all) say where the lines start.");
}

void AddTradeoff(Options command, Line& line) {
  MeasureOptions& m = line.measure;
  command
      .Add("--reference-width", m.reference_width_px,
           "Width of the pictures compared with the optimum; default: as half a minute allows, at most 480")
      .Range(1, kMaxPictureSide);
  command.Flag("--ablation", line.ablation,
               "Instead: the thesis's Fig. 5-3, one optimisation after the other, at one view");
  command.Flag(
      "--time-windows", line.time_windows,
      "Instead: widths of the time window against temporal blur, spatial error, photos in the window and milliseconds");
  command.Add("--against", m.against,
              "With --time-windows: a scene in the same frame whose photos are the truth, instead of held-out photos");
  command.Flag("--properties", line.properties, "Instead: as lumi-render properties");
  command.Add("--view", m.view,
              "With --ablation: this photo's camera, without the photo; default: the first held-out one");
  command.Add("--path", m.path,
              "The first frame of this camera path: what --ablation shows, or where figure-5-4.svg measures; default: "
              "held-out views");
}

void AddMethods(Options command, Line& line) {
  MethodsOptions& m = line.methods;
  command.Add("scene", m.scene, "Scene folder, COLMAP workspace or transforms.json").Required();
  command.Add("-o,--output", m.output, "Folder for methods.json, .csv, .svg and methods-views.csv");
  command.Add("--proxy", m.proxies, "Proxy that all of them blend over; default: the active one").OneEach();
  command.Add("--methods", m.methods, "Those that are compared; default: all").OneEach().OneOf(MethodNames());
  command.Add("--width", m.width_px, "Width of the frames, pixels; default: the photos', at most 1024")
      .Range(1, kMaxPictureSide);
  command
      .Add("--holdout", m.holdout,
           "Every N-th photo is held out; settings are chosen on N/2, N/2+N ... and reported on 0, N ... Of fewer than "
           "24 photos each is left out in turn, settings are chosen on every second and reported on the others")
      .Default();
  command.Add("--views", m.most_views, "Held-out photos that are reported on, at most").Range(1, 100000).Default();
  command.Add("--repeats", m.repeats, "Timed frames a view, after a warm-up").Default();
  command.Flag("--properties", m.properties,
               "Also the columns of the thesis's Table 3.1, a number each, and the ticks that follow");
}

Answer RunMeasuring(const Line& line, ProgressSink& progress) {
  const RenderOptions& o = line.render;
  MeasureOptions m = line.measure;
  if (o.budget_ms) throw UsageError("--budget-ms goes with rendering, not with measuring");
  for (const std::string& proxy : m.proxies)
    if (IsMeshFile(proxy) && std::filesystem::is_regular_file(proxy))
      throw UsageError("what is measured is kept with the scene's own proxies, and " + proxy + " is a file",
                       "bring it in first: lumi-proxy import " + proxy + " SCENE");
  if (o.phase) throw UsageError("--phase goes with rendering, not with measuring: --time-s");
  if (!line.ablation && !m.view.empty()) throw UsageError("tradeoff's --view goes with --ablation");
  if (line.properties && !m.path.empty()) throw UsageError("tradeoff's --path does not go with --properties");
  if (line.ablation + line.properties + line.time_windows > 1)
    throw UsageError("--ablation, --properties and --time-windows do not go together");
  if (!line.time_windows && !m.against.empty()) throw UsageError("--against goes with --time-windows");
  if (line.time_windows && !m.path.empty()) throw UsageError("tradeoff's --path does not go with --time-windows");
  m.backend = o.backend;
  m.settings = o.settings;
  m.effects = o.effects;
  m.decided = o.decided;
  m.rescale_cameras = o.rescale_cameras;
  if (line.properties) return RunProperties(m, progress);
  if (o.settings.method != Algorithm::kUlr)
    throw UsageError("tradeoff turns this renderer's own settings: --method does not go with it",
                     "lumi-render methods compares published methods");
  if (line.time_windows) return RunTimeWindows(m, progress);
  return line.ablation ? RunAblation(m, progress) : RunTradeoff(m, progress);
}

}  // namespace

int main(int argc, char** argv) {
  Program program("lumi-render",
                  "Renders an unstructured lumigraph: a camera path, a photo's own view, or held-out photos");
  Line line;
  AddRendering(program.options(), line);
  const SettingsLine settings(program.options());
  const auto read = [&] {
    RenderOptions& o = line.render;
    for (const std::string& pixel : line.pixels) o.pixels.push_back(PixelFrom(pixel));
    for (const std::string& name : program.options().GivenOf("Options"))
      o.decided.Add(std::string_view(name).substr(name.find_first_not_of('-')));
    ApplySettings(line.settings_file, settings, o);
  };
  const auto measure = [&] {
    read();
    return RunMeasuring(line, program.progress());
  };
  // What of the program's own options the measuring commands start from, or refuse with a reason.
  const std::vector<std::string> start_from = {"Reconstruction", "--effects", "--settings", "--rescale-cameras"};
  std::vector<std::string> measured_with = start_from;
  measured_with.insert(measured_with.end(), {"--backend", "--budget-ms", "--phase"});
  const Options tradeoff = program.Command("tradeoff",
                                           "Accuracy against time: measures settings, recommends some for 8, 16, 33, "
                                           "100 ms and no limit, keeps the front in "
                                           "the scene",
                                           measure, measured_with);
  AddMeasuring(tradeoff, line.measure);
  AddTradeoff(tradeoff, line);
  AddMeasuring(program.Command(
                   "properties", "A figure for each of the nine properties of Table 3.2",
                   [&] {
                     line.properties = true;
                     return measure();
                   },
                   measured_with),
               line.measure);
  AddMethods(program.Command(
                 "methods",
                 "This renderer beside twelve published methods: held-out error and time, each with the "
                 "settings that the choosing fold prefers",
                 [&] {
                   read();
                   if (line.render.settings.method != Algorithm::kUlr ||
                       line.render.settings.correlation == Correlation::kMeasured)
                     throw UsageError(
                         "methods chooses each method's settings itself: neither --method nor --correlation "
                         "measured goes with it",
                         "--methods NAME says which are compared");
                   line.methods.settings = line.render.settings;
                   line.methods.effects = line.render.effects;
                   line.methods.decided = line.render.decided;
                   line.methods.rescale_cameras = line.render.rescale_cameras;
                   return RunMethods(line.methods, program.progress());
                 },
                 start_from),
             line);
  Options table = program.Command("table-3-1", "The thesis's Table 3.1 of what methods --properties measured",
                                  [&] { return RunTable(line.table); });
  table.Add("results", line.table.results, "methods.json of each scene").Required();
  table.Add("-o,--output", line.table.output, "Markdown file");
  Options report = program.Command("methods-report", "What methods measured of some scenes, as tables in Markdown",
                                   [&] { return RunMethodsReport(line.table); });
  report.Add("results", line.table.results, "methods.json of each scene").Required();
  report.Add("-o,--output", line.table.output, "Markdown file");
  program.options().Common({"--output", "--proxy", "--view", "--leave-out", "--holdout", "--path", "--width",
                            "--seconds", "--video", "--format", "--show", "--effects", "--backend", "--budget-ms",
                            "--settings", "--k", "--similarity", "--resolution", "--grid"});
  program.options().Examples(
      "lumi-render scene -o walk.mp4                                 a film along the photos\n"
      "lumi-render scene -o out --view IMG_12.jpg --leave-out        a photo's view, from the others\n"
      "lumi-render scene --holdout 8                                 errors of left-out photos\n"
      "lumi-render scene -o out --view 12 --show false-color         which photo is seen where\n"
      "lumi-render scene -o out --path path.json --budget-ms 33      a path, 33 ms a frame\n"
      "lumi-render tradeoff scene -o out                             what accuracy costs in time");
  program.RunAndExit(argc, argv, [&] {
    read();
    if (line.render.scene.empty()) throw UsageError("a scene is missing", "see lumi-render --help");
    return RunRender(line.render, program.progress());
  });
}
