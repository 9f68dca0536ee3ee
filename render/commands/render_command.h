// What lumi-render does with a scene: a path, one view, or the held-out photos, as pictures, a video and figures.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "render/radiance/settings.h"
#include "render/world/renderer.h"
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
  std::string show = "color";           // one of ShowNames(); difference goes with `view`
  std::string of;                       // the photo that a measure is shown of; empty: the one that weighs most
  std::string format = "png";           // png, jpg, exr
  bool video = false;                   // a path's frames also as OUT/path.mp4
  RadianceSettings settings;            // from --settings and the line
  std::string effects = "auto";         // auto, none, or a list of EffectNames()
  std::set<std::string> decided;        // options and effects that --settings or the line spoke about; format, fold ... on the line
  std::optional<double> phase;          // of the scene's period, instead of a time
  std::optional<double> budget_ms;      // a frame; settings that nobody decided then follow the scene's front or a probe
  bool rescale_cameras = false;
  // Of pictures with a proxy of their own (per-view), and of paths of matrices.
  std::optional<int> window_frames;     // photos to either side in time that a picture may use, -1: all; default: 5 for videos, else all
  double nominal_focal_px = 0;          // of the pictures, where the scene has no metric; 0: 1.2 x their longer side
  std::string border = "black";         // black, fill: pixels that no photo of the window sees
  int fill_frames = 30;                 // fill: so many photos to either side are asked, before colours are made up
};

// color, false-color, tessellation, difference, cameras, and the measures of show/measure_map.h.
const std::vector<std::string>& ShowNames();

// Throws UsageError for what does not fit together. Returns the summary as JSON text.
std::string RunRender(const RenderOptions& options, ProgressSink& progress);

// A few lines for people from that JSON.
std::string DescribeRender(const std::string& json);

}  // namespace lumi
