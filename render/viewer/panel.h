// The viewer's panel (Dear ImGui): what it shows, and what the user asked for in it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/radiance/settings.h"
#include "render/renderer.h"

namespace lumi {

// What the user may change; keys change the same.
struct ViewerSettings {
  RadianceSettings radiance;
  Show show = Show::kColor;
  bool frusta = false;
  bool mesh = false;
  bool panel = true;
  bool help = false;
};

struct PanelFacts {
  std::string scene, device;
  double picture_ms = 0;       // the last picture drawn in one go
  double frame_ms = 0;         // from frame to frame, smoothed
  double scale = 1;            // of the shown picture against the window
  bool complete = false;
  int photos_loaded = 0, photos_total = 0, photos_failed = 0;
  double photo_mb = 0, budget_mb = 0;
  int halvings = 0;            // of the photos, to stay within the budget
  std::vector<std::string> photo_names;
  int nearest_photo = -1;
  std::vector<std::string> proxies;
  std::string proxy;           // the one that is shown
  int faces = 0;
  bool proxy_loading = false;
  std::string message;         // a line that fades
};

struct PanelWishes {
  std::optional<int> jump_to;
  std::optional<std::string> proxy;
  bool screenshot = false;
  bool home = false;
};

// Between Window::BeginUi and EndUi.
PanelWishes DrawPanel(const PanelFacts& facts, ViewerSettings& settings);
// While the scene is opened; fraction < 0: unknown.
void DrawOpening(const std::string& scene, const std::string& task, double fraction);
// A ring around the point that an orbit turns about.
void DrawPivot(double x_px, double y_px, double pixel_density);

}  // namespace lumi
