// What lumi-render does with a scene: a path, one view, or the held-out photos, as pictures, a video and figures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "render/radiance/settings.h"
#include "render/renderer.h"
#include "render/tradeoff/budget.h"
#include "scene/files/scene_folder.h"
#include "scene/program/progress.h"

namespace lumi {

struct RenderOptions {
  std::filesystem::path scene;
  std::filesystem::path output;         // a folder, or a file ending in .mp4 for a path
  std::string proxy;                    // name, empty: the active one
  std::filesystem::path path;           // camera path JSON; empty: through the photos' own cameras
  std::string view;                     // this photo's own camera
  bool leave_out = false;               // with `view`: the photo itself is not used
  int holdout = 0;                      // N, 0: no
  std::string fold = "report";          // report, choose
  int width_px = 0, height_px = 0;      // 0: the photo's (view, holdout), or 1024 wide (path)
  double seconds = 12;                  // of the path through the photos
  double fps = 30;
  std::string backend = "cpu";          // cpu, gl
  std::string show = "color";           // color, false-color, difference (with `view`)
  std::string format = "png";           // png, jpg, exr
  bool video = false;                   // a path's frames also as OUT/path.mp4
  RadianceSettings settings;            // complete: from --settings, --effects and the line
  std::optional<double> budget_ms;      // a frame; settings then follow the scene's front or a probe ...
  FixedOptions given;                   // ... but for these: options of the reconstruction that the user named
  bool rescale_cameras = false;
};

// Throws UsageError for what does not fit together. Returns the summary as JSON text (keys of DESIGN.md's `render`).
std::string RunRender(const RenderOptions& options, ProgressSink& progress);

// A few lines for people from that JSON.
std::string DescribeRender(const std::string& json);

}  // namespace lumi
