#include <cstdlib>
#include <string>

#include "render/radiance/settings.h"
#include "render/viewer/viewer.h"
#include "scene/program/main_program.h"

int main(int argc, char** argv) {
  lumi::Program program("lumi-view", "Walks through an unstructured lumigraph in a window");
  lumi::ViewerOptions o;
  std::string k = "4";
  CLI::App& app = program.app();
  app.add_option("scene", o.scene, "Scene folder, COLMAP workspace or transforms.json")->required();
  app.add_option("--proxy", o.proxy, "Proxy by name; default: the scene's active one");
  app.add_option("--view", o.view, "Start at this photo's camera: name, or position from 0; default: the middle photo");
  app.add_option("--width", o.width_px, "Of the window, pixels")->check(CLI::Range(64, 16384))->capture_default_str();
  app.add_option("--height", o.height_px, "Of the window, pixels")->check(CLI::Range(64, 16384))->capture_default_str();
  app.add_option("--memory-mb", o.memory_mb, "Photos are halved until all of them fit into this")->check(CLI::Range(16, 1 << 20))->capture_default_str();
  app.add_option("--k", k, "Photos blended at a pixel: 1 to 16, or all")->capture_default_str();
  app.add_option("--screenshot", o.screenshot, "When all is loaded, write this picture and end");
  app.add_option("--script", o.script, "Statements, as 'jump 3; orbit 10 0; wait; screenshot a.png' (docs/viewer.md); ends after the last");
  app.add_flag("!--no-ui", o.show_ui, "No panel, also in screenshots");
  app.add_flag("--rescale-cameras", o.rescale_cameras, "Fit cameras to photos of another size instead of refusing them");
  return program.Run(argc, argv, [&] {
    o.k = k == "all" ? 0 : std::atoi(k.c_str());
    if (k != "all" && (o.k < 1 || o.k > lumi::kMaxBlend || k.find_first_not_of("0123456789") != std::string::npos))
      throw lumi::UsageError("--k takes 1 to " + std::to_string(lumi::kMaxBlend) + ", or all, not " + k);
    return lumi::RunViewer(o, program.progress());
  });
}
