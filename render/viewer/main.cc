#include "render/commands/settings_line.h"
#include "render/viewer/viewer.h"
#include "scene/program/main_program.h"

int main(int argc, char** argv) {
  lumi::Program program("lumi-view", "Walks through an unstructured lumigraph in a window");
  lumi::ViewerOptions o;
  lumi::Options& app = program.options();
  app.Add("scene", o.scene, "Scene folder, COLMAP workspace or transforms.json").Required();
  app.Add("--proxy", o.proxy, "Proxy by name, or a mesh file (PLY, OBJ); default: the scene's active one");
  app.Add("--view", o.view,
          "Start at this photo's camera: its name, or else its position from 0; default: the middle photo");
  app.Add("--width", o.width_px, "Of the window, pixels").Range(64, 16384).Default();
  app.Add("--height", o.height_px, "Of the window, pixels").Range(64, 16384).Default();
  app.Add("--memory-mb", o.memory_mb,
          "Memory of the program, graphics memory included; photos that do not fit are read as the view needs them")
      .Range(16, 1 << 20)
      .Default();
  app.Add("--effects", o.effects, lumi::EffectsHelp()).Default();
  app.Add("--phase", o.phase, "Moment of a periodic scene to begin with, 0 to 1 of its period");
  app.Add("--budget-ms", o.budget_ms,
          "A frame while the camera moves: settings and size hold it, at rest the picture is refined")
      .Range(1.0, 1e4);
  app.Call(
         "--refine", [&o](const std::string& text) { o.refine = text == "on"; },
         "At rest, optimal weights at every pixel (CPU, in the background): on or off; default: with a budget or the "
         "optimum")
      .OneOf({"on", "off"});
  app.Add(
      "--path", o.path,
      "Camera path JSON to begin with: ours or nerfstudio's; or the path of matrices (lumi-stabilize) that is played");
  app.Add("--screenshot", o.screenshot, "When all is loaded, write this picture and end");
  app.Add("--script", o.script,
          "Statements, as 'jump 3; orbit 10 0; wait; screenshot a.png' (docs/viewer.md); ends after the last");
  app.Flag("!--no-ui", o.show_ui, "No panel, also in screenshots");
  app.Flag("--rescale-cameras", o.rescale_cameras, "Fit cameras to photos of another size instead of refusing them");
  const lumi::SettingsLine settings(app);
  app.Common({"--proxy", "--view", "--width", "--height", "--budget-ms", "--effects", "--path", "--screenshot", "--k",
              "--grid"});
  app.Examples(
      "lumi-view scene\n"
      "lumi-view colmap-workspace --proxy mesh.ply     over a mesh made elsewhere\n"
      "lumi-view scene --budget-ms 33                  as good as 33 ms a frame allow");
  program.RunAndExit(argc, argv, [&] {
    for (const std::string& name : program.options().GivenOf("Options"))
      o.decided.Add(std::string_view(name).substr(name.find_first_not_of('-')));
    settings.Apply(o.settings, o.decided);
    return lumi::Answer(lumi::RunViewer(o, program.progress()), "");
  });
}
