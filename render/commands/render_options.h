// What lumi-render is asked for.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "render/lumigraph/lumigraph.h"
#include "scene/program/part.h"

namespace lumi {

// Frames first to last of a path.
struct FrameRange {
  std::size_t first = 0, last = 0;
};
// "A-B" or "A". Throws UsageError.
FrameRange FrameRangeFrom(const std::string& text);

struct RenderOptions : LumigraphOptions {  // `decided` also has the command line's --format, --fold ...
  std::string proxy;                       // name, per-view, or empty: the active one
  std::filesystem::path output;            // a folder, or a file ending in .mp4 for a path
  std::filesystem::path path;              // camera path JSON; empty: through the photos' own cameras
  std::string view;                        // this photo's own camera
  bool leave_out = false;                  // with `view`: the photo itself is not used
  int holdout = 0;                         // N, kHoldoutEach, kHoldoutAuto, 0: no
  std::string fold = "report";             // report, choose
  std::string seen_proxy;           // with `holdout`: says which pixels count as seen; empty: the one rendered over
  int width_px = 0, height_px = 0;  // 0: the photo's (view, holdout), or 1024 wide (path)
  double seconds = 12;              // of the path through the photos
  double fps = 30;
  std::string backend = "cpu";          // cpu, gl
  std::string show = "color";           // one of ShowNames(); difference goes with `view`
  std::string of;                       // the photo that a measure is shown of; empty: the one that weighs most
  std::vector<Eigen::Vector2d> pixels;  // with `view`: what these are blended from is told; centres at i + 0.5
  std::string format = "png";           // png, jpg, exr
  bool video = false;                   // a path's frames also as OUT/path.mp4
  // Of a path: only these frames. Several machines may render parts of a path into one folder; a run without these
  // options then joins them.
  std::optional<FrameRange> frames;
  std::optional<Part> shard;
  std::optional<double> budget_ms;  // a frame; undecided settings then follow the scene's front or a probe
  // Of a path: PSNR (dB) that sparse samples must reach against weights at every pixel.
  std::optional<double> fidelity_db;

  bool to_video() const { return output.extension() == ".mp4"; }
  bool part_of_path() const { return frames || shard; }
  bool along_path() const { return holdout == 0 && view.empty(); }
};

// "X,Y" of --pixel. Throws UsageError.
Eigen::Vector2d PixelFrom(const std::string& text);

// --holdout auto: each where the scene has fewer photos than a fold can judge by, else every eighth.
constexpr int kHoldoutAuto = -2, kFewestForFolds = 24, kUsualHoldout = 8;
// --holdout's word: N >= 2, each, or auto. Throws UsageError.
int HoldoutFrom(const std::string& text);
// Replaces kHoldoutAuto by its choice for this many photos; other values are returned as they are.
int HoldoutFor(int holdout, std::size_t photos);

// color, false-color, tessellation, difference, cameras, and the measures of show/measure_map.h.
const std::vector<std::string>& ShowNames();

// Throws UsageError for options that do not go together, or that would have no effect.
void RequireConsistent(const RenderOptions& options);

}  // namespace lumi
