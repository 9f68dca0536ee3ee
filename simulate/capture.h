// A capture on disk: a scene folder of photos with everything that is true about them beside it.
//
//   CAPTURE/images/NAME.jpg  sparse/  lumigraph.json  proxies/truth.ply  provenance/simulate.json
//   CAPTURE/truth/           sparse/  cameras.json  depth/NAME.exr  silhouettes/NAME.png  mesh.ply  timestamps.csv
//   scene.json
// Of a path with a shake also truth/steady.json: cameras.json as it would be without.
// With motion blur also truth/blur.csv: how many pixels long it is in each photo.
// Of a scene with moving parts also truth/moving/NAME.png; of one that repeats itself video.mp4 and, where it describes
// a camera on a tripod, fixed.mp4.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/files/json_keys.h"
#include "scene/program/progress.h"
#include "simulate/view_renderer.h"

namespace lumi {

struct SimulateOptions {
  std::filesystem::path scene_file;  // either this
  std::string example;               // or one of ExampleNames()
  std::filesystem::path output;      // absent, empty, or a capture of ours made with the same options
  bool replace = false;              // the output may be a capture made with any options
  int views = 0;                     // so many, evenly spread; 0: all
  int width_px = 0;                  // of every photo; 0: as described
  int fixed_frames = -1;             // of fixed.mp4; 0: none; -1: as described
  // Instead of the scene's path: views at any place and time, without noise and exposure drift, as PNG. The keys of a
  // camera path as lumi-render reads it (docs/render.md), one photo a key; a key may have `phase`, of the scene's
  // period, for time_s. --views does not apply.
  std::filesystem::path at_file;
  bool video = false;  // video.mp4 beside the photos, also of a scene without a period; `views` are its first frames
  std::optional<double>
      shake;            // so many times the shake that the scene describes; a walk or drive without any gets a walk's
  bool steady = false;  // the ideal path: without shake, rolling shutter and noise
  std::optional<double> blur_s;  // exposure time, in place of the scene's; 0: no motion blur
  // In place of the scene's; 0: none.
  std::optional<double> vignetting, white_balance_stops;
  int blur_every = 0;  // one photo in so many is blurred, the others are sharp; 0: as described
  int portrait_every =
      0;  // one photo in so many is taken with the camera turned by a quarter, as its EXIF says; 0: none
  std::uint64_t seed = 0;
};
// What is wrong with the options, or nullopt.
std::optional<std::string> Validate(const SimulateOptions& options);

struct SimulateSummary {
  std::string scene;
  std::filesystem::path output;
  int views = 0;
  int width_px = 0, height_px = 0;  // of the first photo
  int points = 0;
  double seconds = 0;
  TraceCounters counters;
  std::vector<std::string> effects;  // those that the scene asks for
  bool reused = false;               // the folder holds this capture already: nothing was done
};

// Throws UsageError (options, somebody else's folder), InputError (the scene), MachineError (the disk).
SimulateSummary Simulate(const SimulateOptions& options, ProgressSink& progress);

void ListKeys(JsonKeys& j, SimulateSummary& summary);
std::string Describe(const SimulateSummary& summary);

}  // namespace lumi
