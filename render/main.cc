#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <map>
#include <nlohmann/json.hpp>

#include "render/commands/render_command.h"
#include "render/settings_json.h"
#include "render/tradeoff/properties.h"
#include "render/tradeoff/tradeoff.h"
#include "scene/files/atomic_file.h"
#include "scene/program/main_program.h"

namespace {

// Options of the reconstruction as they stand on the command line.
using Given = std::map<std::string, std::string>;

// Defaults, then the file's own words, then the command line's.
void ApplySettings(const std::filesystem::path& file, const Given& given, lumi::RenderOptions& options) {
  if (!file.empty()) {
    try {
      nlohmann::ordered_json j = nlohmann::ordered_json::parse(lumi::ReadText(file));
      if (j.contains("settings")) j = j["settings"];
      for (const auto& [name, value] : j.items()) {
        if (name == "backend") {
          options.backend = value.get<std::string>();
          if (options.backend != "cpu" && options.backend != "gl")
            throw lumi::InputError(file, "backend takes cpu or gl, not " + options.backend);
        } else if (lumi::SetOption(options.settings, name, value))
          options.decided.Add(name);
        else
          throw lumi::InputError(file, "\"" + name + "\" is not a setting of the reconstruction");
      }
    } catch (const nlohmann::json::exception& e) {
      throw lumi::InputError(file, std::string("not a settings file: ") + e.what());
    } catch (const lumi::UsageError& e) {
      throw lumi::InputError(file, e.what());
    }
  }
  for (const auto& [name, value] : given)
    if (!value.empty()) {
      lumi::SetOption(options.settings, name, value);
      options.decided.Add(name);
    }
  if (options.phase && !given.at("time-s").empty())
    throw lumi::UsageError("--phase and --time-s do not go together: both say when");
  // Who names a time wants it to count.
  if ((!given.at("time-s").empty() || options.phase ||
       (options.decided.Has("time-s") && !options.decided.Has("time"))) &&
      given.at("time").empty()) {
    options.settings.time = true;
    options.decided.Add("time");
  }
  // What the optimum needs and nobody spoke against: 1/h is no covariance, and candidates are weighed one by one. The
  // line's
  // --similarity full wins over what a file, written for another similarity, says of them.
  if (options.settings.similarity == lumi::Similarity::kFull) {
    const auto open = [&](const char* name) {
      return given.at(name).empty() && (!given.at("similarity").empty() || !options.decided.Has(name));
    };
    if (open("correlation")) options.settings.correlation = lumi::Correlation::kFallingLeaves;
    if (open("sampling")) options.settings.sampling = lumi::Sampling::kInterpolated;
  }
}

// What stands on the command line.
struct Line {
  lumi::RenderOptions render;
  lumi::MeasureOptions measure;
  Given given;
  std::filesystem::path settings_file;
  CLI::Option* budget = nullptr;
  double budget_ms = 0;
  std::string window_frames, border = "black";
  CLI::App *tradeoff = nullptr, *properties_command = nullptr;
  bool ablation = false, properties = false, time_windows = false;
};

// 0 stands for "not given" inside; nobody may give it.
const CLI::Range kSide(1, lumi::kMaxPictureSide);

void AddRendering(CLI::App& app, Line& line) {
  lumi::RenderOptions& o = line.render;
  app.add_option("scene", o.scene, "Scene folder, COLMAP workspace or transforms.json");
  app.add_option("-o,--output", o.output, "Folder for pictures, or FILE.mp4 for a path");
  app.add_option("--proxy", o.proxy,
                 "Proxy by name; per-view: the points triangulated in each view; default: the scene's active one");
  app.add_option("--path", o.path,
                 "Camera path JSON, of poses or (lumi-stabilize) of projection matrices; default: through the photos' "
                 "own cameras");
  app.add_option("--view", o.view, "Render at this photo's own camera");
  app.add_flag("--leave-out", o.leave_out, "With --view: without that photo");
  app.add_option("--holdout", o.holdout, "Render photos 0, N, 2N ... from the others and compare (N >= 2)");
  app.add_option("--fold", o.fold, "Photos that --holdout takes: report 0, N ..., choose N/2, N/2+N ...")
      ->check(CLI::IsMember({"report", "choose"}))
      ->capture_default_str();
  app.add_option("--width", o.width_px, "Width in pixels; default: the photo's, or at most 1024 for a path")
      ->check(kSide);
  app.add_option("--height", o.height_px, "Height in pixels; default: by the photos' aspect")->check(kSide);
  app.add_option("--seconds", o.seconds, "Length of the path through the photos")->capture_default_str();
  app.add_option("--fps", o.fps, "Frames a second of that path")->capture_default_str();
  app.add_flag("--video", o.video, "Also write the path as path.mp4 (H.264)");
  app.add_option("--format", o.format, "Of the pictures")
      ->check(CLI::IsMember({"png", "jpg", "exr"}))
      ->capture_default_str();
  app.add_option("--backend", o.backend, "Where frames are blended")
      ->check(CLI::IsMember({"cpu", "gl"}))
      ->capture_default_str();
  line.budget = app.add_option("--budget-ms", line.budget_ms,
                               "Choose settings for this time a frame, > 0: from the scene's measured front, else by a "
                               "probe; options given stay");
  app.add_option("--show", o.show, "What is shown")->check(CLI::IsMember(lumi::ShowNames()))->capture_default_str();
  app.add_option("--of", o.of, "With --show weights, angle ...: of this photo; default: of the one that weighs most");
  app.add_option(
         "--effects", o.effects,
         fmt::format("auto: what the data call for; none; or a list of {}", fmt::join(lumi::EffectNames(), ", ")))
      ->capture_default_str();
  app.add_option("--phase", o.phase, "The view's time as a fraction of the scene's period");
  for (const lumi::SettingOption& s : lumi::SettingOptions())
    app.add_option("--" + s.name, line.given[s.name], s.help)
        ->type_name(s.value)
        ->default_str(s.fallback)
        ->group("Reconstruction");
  app.add_option("--settings", line.settings_file,
                 "JSON object of the reconstruction's options; what stands on the command line wins");
  app.add_option("--window-frames", line.window_frames,
                 "Photos to either side in time that a picture may use, 0 to 1000, or all; default: 5 along a path of "
                 "matrices and in videos without a metric, else all");
  app.add_option("--border", line.border,
                 "Pixels that no photo of the window sees: black (a hole), or fill: from photos farther away in time, "
                 "the rest smoothly")
      ->check(CLI::IsMember({"black", "fill"}))
      ->capture_default_str();
  app.add_option("--fill-frames", o.border.reach, "With --border fill: photos to either side that are asked")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--nominal-focal-px", o.nominal_focal_px,
                 "Focal length that turns vanishing points into angles where the scene has no metric, > 0, pixels of "
                 "the picture; default: 1.2 x its longer side")
      ->check(CLI::PositiveNumber);
  app.add_flag("--rescale-cameras", o.rescale_cameras,
               "Fit cameras to photos of another size instead of refusing them");
}

// The options of the reconstruction go to either side of a measuring command's name.
CLI::App* AddMeasuringCommand(CLI::App& app, lumi::MeasureOptions& m, const char* name, const char* what) {
  CLI::App* command = app.add_subcommand(name, what);
  command->add_option("scene", m.scene, "Scene folder, COLMAP workspace or transforms.json")->required();
  command->add_option("-o,--output", m.output, "Folder for tables, plots and pictures");
  command->add_option("--proxy", m.proxies, "Proxies to measure; default: all the scene has, the active one first")
      ->allow_extra_args(false);
  command->add_option("--width", m.width_px, "Width of the frames, pixels; default: the photos', at most 1024")
      ->check(kSide);
  command
      ->add_option("--holdout", m.holdout,
                   "Every N-th photo is held out; settings are chosen on N/2, N/2+N ... and reported on 0, N ...")
      ->capture_default_str();
  command->add_option("--views", m.views, "Held-out photos that are measured")->capture_default_str();
  command->add_option("--repeats", m.repeats, "Timed frames a view and setting, after a warm-up")
      ->capture_default_str();
  command->add_flag("--quick", m.quick, "Fewer settings, at most 320 pixels wide");
  command->footer("Options of the reconstruction (see lumi-render --help) say where the lines start.");
  return command;
}

void AddMeasuring(CLI::App& app, Line& line) {
  lumi::MeasureOptions& m = line.measure;
  CLI::App* tradeoff = line.tradeoff =
      AddMeasuringCommand(app, m, "tradeoff",
                          "Accuracy against time: measures settings, recommends some for 8, 16, 33, 100 ms and no "
                          "limit, keeps the front in the scene");
  tradeoff
      ->add_option("--reference-width", m.reference_width_px,
                   "Width of the pictures compared with the optimum; default: as half a minute allows, at most 480")
      ->check(kSide);
  tradeoff->add_flag("--ablation", line.ablation,
                     "Instead: the thesis's Fig. 5-3, one optimisation after the other, at one view");
  tradeoff->add_flag(
      "--time-windows", line.time_windows,
      "Instead: widths of the time window against temporal blur, spatial error, photos in the window and milliseconds");
  tradeoff->add_option(
      "--against", m.against,
      "With --time-windows: a scene in the same frame whose photos are the truth, instead of held-out photos");
  tradeoff->add_flag("--properties", line.properties, "Instead: as lumi-render properties");
  tradeoff->add_option("--view", m.view,
                       "With --ablation: this photo's camera, without the photo; default: the first held-out one");
  tradeoff->add_option("--path", m.path,
                       "The first frame of this camera path: what --ablation shows, or where figure-5-4.svg measures; "
                       "default: held-out views");
  line.properties_command =
      AddMeasuringCommand(app, m, "properties", "A figure for each of the nine properties of Table 3.2");
}

std::optional<int> WindowFrames(const std::string& text) {
  if (text.empty()) return std::nullopt;
  if (text == "all") return -1;
  int frames = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), frames);
  if (error != std::errc() || end != text.data() + text.size() || frames < 0 || frames > 1000)
    throw lumi::UsageError("--window-frames takes 0 to 1000, or all; not " + text);
  return frames;
}

void Read(const CLI::App& app, Line& line) {
  lumi::RenderOptions& o = line.render;
  const std::string backend = o.backend;
  ApplySettings(line.settings_file, line.given, o);
  if (app.get_option("--backend")->count() > 0) o.backend = backend;
  o.window_frames = WindowFrames(line.window_frames);
  o.border.fill = line.border == "fill";
  for (const std::string name : {"format", "fold", "seconds", "fps", "fill-frames"})
    if (app.get_option("--" + name)->count() > 0) o.decided.Add(name);
  line.properties = line.properties || line.properties_command->parsed();
}

lumi::MeasureOptions Measuring(const Line& line) {
  const lumi::RenderOptions& o = line.render;
  lumi::MeasureOptions m = line.measure;
  if (*line.budget) throw lumi::UsageError("--budget-ms goes with rendering, not with measuring");
  if (o.phase) throw lumi::UsageError("--phase goes with rendering, not with measuring: --time-s");
  if (!line.ablation && !m.view.empty()) throw lumi::UsageError("tradeoff's --view goes with --ablation");
  if (line.properties && !m.path.empty()) throw lumi::UsageError("tradeoff's --path does not go with --properties");
  if (line.ablation + line.properties + line.time_windows > 1)
    throw lumi::UsageError("--ablation, --properties and --time-windows do not go together");
  if (!line.time_windows && !m.against.empty()) throw lumi::UsageError("--against goes with --time-windows");
  if (line.time_windows && !m.path.empty()) throw lumi::UsageError("tradeoff's --path does not go with --time-windows");
  m.backend = o.backend;
  m.settings = o.settings;
  m.effects = o.effects;
  m.decided = o.decided;
  m.rescale_cameras = o.rescale_cameras;
  return m;
}

}  // namespace

int main(int argc, char** argv) {
  lumi::Program program("lumi-render",
                        "Renders an unstructured lumigraph: a camera path, a photo's own view, or held-out photos");
  Line line;
  AddRendering(program.app(), line);
  AddMeasuring(program.app(), line);
  std::string text;  // for people
  return program.Run(
      argc, argv,
      [&] {
        Read(program.app(), line);
        if (line.properties) {
          const lumi::PropertiesSummary properties = lumi::RunProperties(Measuring(line), program.progress());
          text = lumi::Describe(properties);
          return ToJson(properties).dump();
        }
        if (line.time_windows) return lumi::RunTimeWindows(Measuring(line), program.progress());
        if (line.ablation) return lumi::RunAblation(Measuring(line), program.progress());
        if (line.tradeoff->parsed()) return lumi::RunTradeoff(Measuring(line), program.progress());
        if (line.render.scene.empty()) throw lumi::UsageError("a scene is wanted", "see lumi-render --help");
        if (*line.budget) line.render.budget_ms = line.budget_ms;
        const lumi::RenderSummary rendered = lumi::RunRender(line.render, program.progress());
        text = lumi::Describe(rendered);
        return lumi::JsonText(rendered);
      },
      [&](const std::string& json) {
        if (line.time_windows) return lumi::DescribeTimeWindows(json);
        if (line.ablation) return lumi::DescribeAblation(json);
        return text.empty() ? lumi::DescribeTradeoff(json) : text;
      });
}
