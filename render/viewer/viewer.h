// lumi-view: walks through a lumigraph in a window.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "render/lumigraph/lumigraph.h"
#include "scene/program/progress.h"

namespace lumi {

struct ViewerOptions : LumigraphOptions {  // settings: at the start; effects leave alone what was decided
  std::string proxy;                       // name, empty: the active one
  std::string view;                        // photo whose camera is the start: name or position; empty: the middle one
  int width_px = 1280, height_px = 800;    // of the window, where `decided` has them; else as it was the last time
  int memory_mb = 2048;                    // of the program, graphics memory included
  std::filesystem::path screenshot;        // written when everything is loaded; then the viewer ends
  std::string script;                      // statements (script.h); the viewer ends after the last
  bool panel = true;                       // is shown at the start
  bool show_ui = true;                     // false: no panel, also in screenshots
  double budget_ms = 0;                    // a frame while the camera moves; 0: none
  std::optional<bool> refine;  // to optimal weights at rest; unset: only with a budget, or if the optimum is asked for
  std::filesystem::path path;  // camera path JSON to begin with
};

// Blocks until the window is closed. Returns a summary: frames, median_frame_ms, photos_loaded ...
// Throws UsageError, InputError, MachineError (no display, no OpenGL 4.3).
JsonKeys RunViewer(const ViewerOptions& options, ProgressSink& progress);

}  // namespace lumi
