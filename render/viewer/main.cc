#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "render/settings_json.h"
#include "render/viewer/viewer.h"
#include "scene/program/main_program.h"

int main(int argc, char** argv) {
  lumi::Program program("lumi-view", "Walks through an unstructured lumigraph in a window");
  lumi::ViewerOptions o;
  std::map<std::string, std::string> given;
  std::string refine;
  CLI::App& app = program.app();
  app.add_option("scene", o.scene, "Scene folder, COLMAP workspace or transforms.json")->required();
  app.add_option("--proxy", o.proxy, "Proxy by name; default: the scene's active one");
  app.add_option("--view", o.view, "Start at this photo's camera: name, or position from 0; default: the middle photo");
  app.add_option("--width", o.width_px, "Of the window, pixels")->check(CLI::Range(64, 16384))->capture_default_str();
  app.add_option("--height", o.height_px, "Of the window, pixels")->check(CLI::Range(64, 16384))->capture_default_str();
  app.add_option("--memory-mb", o.memory_mb, "Photos are halved until all of them fit into this")
      ->check(CLI::Range(16, 1 << 20))
      ->capture_default_str();
  app.add_option(
         "--effects", o.effects,
         fmt::format("auto: what the data call for; none; or a list of {}", fmt::join(lumi::EffectNames(), ", ")))
      ->capture_default_str();
  app.add_option("--phase", o.phase, "Moment of a periodic scene to begin with, 0 to 1 of its period");
  app.add_option("--budget-ms", o.budget_ms,
                 "A frame while the camera moves: settings and size hold it, at rest the picture is refined")
      ->check(CLI::Range(1.0, 1e4));
  app.add_option("--refine", refine,
                 "At rest, optimal weights at every pixel (CPU, in the background): on or off; default: with a budget "
                 "or the optimum")
      ->check(CLI::IsMember({"on", "off"}));
  app.add_option(
      "--path", o.path,
      "Camera path JSON to begin with: ours or nerfstudio's; or the path of matrices (lumi-stabilize) that is played");
  app.add_option("--screenshot", o.screenshot, "When all is loaded, write this picture and end");
  app.add_option("--script", o.script,
                 "Statements, as 'jump 3; orbit 10 0; wait; screenshot a.png' (docs/viewer.md); ends after the last");
  app.add_flag("!--no-ui", o.show_ui, "No panel, also in screenshots");
  app.add_flag("--rescale-cameras", o.rescale_cameras,
               "Fit cameras to photos of another size instead of refusing them");
  for (const lumi::SettingOption& s : lumi::SettingOptions())
    app.add_option("--" + s.name, given[s.name], s.help)
        ->type_name(s.value)
        ->default_str(s.fallback)
        ->group("Reconstruction");
  return program.Run(argc, argv, [&] {
    for (const auto& [name, value] : given)
      if (!value.empty()) {
        lumi::SetOption(o.settings, name, value);
        o.decided.Add(name);
      }
    if (!refine.empty()) o.refine = refine == "on";
    // What the optimum needs and nobody spoke against.
    if (o.settings.similarity == lumi::Similarity::kFull) {
      if (given["correlation"].empty()) o.settings.correlation = lumi::Correlation::kFallingLeaves;
      if (given["sampling"].empty()) o.settings.sampling = lumi::Sampling::kInterpolated;
    }
    return lumi::RunViewer(o, program.progress());
  });
}
