// What lumi-pipeline can be asked for.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace lumi {

class Executor;

struct PipelineOptions {
  std::filesystem::path input;                     // folder of photos, a video, a COLMAP workspace, or a scene of ours
  std::vector<std::filesystem::path> inputs;       // several videos of one place, `input` the first; else that alone
  std::filesystem::path output;                    // the scene; may be empty where input is a scene of ours
  std::filesystem::path calibration;               // photos or a video of a checkerboard, or a camera.yaml; empty: none
  std::string board, square_mm;                    // passed on to lumi-calibrate as they are; empty: its defaults
  std::vector<std::string> reconstruct_arguments;  // passed on to lumi-reconstruct as they are
  bool periodic = false;  // a video of a scene that repeats itself: lumi-timeperiodic places it in space and time
  std::filesystem::path fixed_video;    // of the same scene from a tripod, for the period; empty: the video itself
  std::string period_frames;            // a period that is known; empty: found
  bool rescale_cameras = false;         // a workspace's cameras are scaled to its photos instead of being refused
  std::string proxy = "auto";           // lumi-proxy's kind: auto, plane, planes, box, delaunay, dense, moving, hull
  std::optional<double> proxy_minutes;  // of auto's depth maps (proxy/commands.h)
  std::optional<double> budget_ms;      // of a frame over the proxy that auto chooses; none: the best proxy
  // Minutes that the whole run may take: they decide its quality, and film and page are left out where no time is left.
  std::optional<double> minutes;
  // Where the object's silhouettes come from, at most one: a rule on colours, a folder of masks, a photo (or a folder
  // of photos) of the background. None: those that the scene has.
  std::string silhouette_rule;
  std::filesystem::path silhouettes, silhouette_background;
  int faces = 0;    // the proxy is simplified to so many; a hull by collapses that keep it a hull. 0: as it is
  int holdout = 8;  // every Nth photo is rendered from the others; 0: not evaluated, else >= 2
  bool holdout_each = false;  // instead every photo in turn; `holdout` then says on which fold a proxy is chosen
  std::string render_backend = "cpu";  // cpu, gl
  bool video = true;                   // the fly-through
  bool video_fill = true;              // its holes get smooth colours from around them
  bool web = true;                     // the page to walk in, web.html
  double web_mb = 32;                  // at most so large
  int video_width_px = 960;
  double video_seconds = 6;
  // PSNR that the fly-through's frames must keep against frames with weights at every pixel; a lower one is faster. 0:
  // weights at every pixel.
  double video_fidelity_db = 40;
  int threads = 0;                               // 0: all cores
  std::shared_ptr<Executor> executor = nullptr;  // where stages run; none: here
  int parts = 1;                                 // with an executor: jobs that depth maps are divided among
  std::optional<int> depth_width_px;             // of auto's depth maps, instead of what auto takes
  unsigned long long seed = 0;
};

// Empty, or what is wrong, naming the option.
std::string Validate(const PipelineOptions& options);

// Where the object's silhouettes come from is given.
bool HasSilhouetteSource(const PipelineOptions& options);
// A calibration that is a camera already, not photos of a board.
bool IsCameraFile(const std::filesystem::path& path);

}  // namespace lumi
