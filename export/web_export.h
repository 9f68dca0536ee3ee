// lumi-export web: a scene as a web page to walk in. The page draws with WebGL 2, by the renderer's own formulas
// (render/gl's shader text), from photos and a proxy that were reduced until they fit. The reduction is chosen among
// several by its held-out error. docs/web.md.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/files/json_keys.h"
#include "scene/program/progress.h"

namespace lumi {

struct WebOptions {
  std::filesystem::path scene;
  std::filesystem::path output;    // FILE.html: one page; else a folder for a web server
  std::string proxy;               // by name; empty: the active one
  std::string effects = "auto";    // as lumi-render --effects
  double max_mb = 32;              // of everything that is written, > 0, megabytes of 10^6 bytes
  double memory_mb = 0;            // of the graphics processor that the page takes; 0: by the device, at most 1024
  int width_px = 0;                // of the photos, at most; 0: as is best for the megabytes
  std::filesystem::path as_scene;  // the data that the page holds as a scene, too, for lumi-render; empty: not
  bool tradeoff = false;           // instead of a page: megabytes against held-out error
};

// JPEG's qualities: of the photos' own files, where they are JPEGs whose pixels are the photo's, and kBestCoded else.
inline constexpr int kAsTheyAre = 100, kBestCoded = 96;

// One way to make photos smaller.
struct PhotoReduction {
  int every = 1;       // 1: all photos; 2: every second one ...
  double scale = 1;    // of a photo's sides
  int quality = 90;    // of JPEG; kAsTheyAre
  double mb = 0;       // of the page with them
  int own = 0;         // photos whose own files are taken
  double psnr_db = 0;  // held-out photos, over the pixels that are seen; 0: not measured
};
void ListKeys(JsonKeys& j, PhotoReduction& r);
// "as they are", "JPEG quality 85".
std::string DescribeQuality(const PhotoReduction& r, int photos);

struct WebSummary {
  std::string output, proxy;
  int photos = 0, photos_of_scene = 0;
  int faces = 0;
  double mb = 0;
  PhotoReduction chosen;
  std::vector<PhotoReduction> tried;
  double seconds = 0;
};
void ListKeys(JsonKeys& j, WebSummary& s);
std::string Describe(const WebSummary& s);

// Throws UsageError, InputError, DataError (no metric, nothing fits), MachineError.
WebSummary ExportWeb(const WebOptions& options, ProgressSink& sink);

}  // namespace lumi
