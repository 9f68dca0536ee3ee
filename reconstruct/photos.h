// Which files of a folder are photographs that can be used; the others, with reasons. Nothing is written here.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/options.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

struct InputPhoto {
  std::string name;  // relative to the folder, with '/'
  int width_px = 0, height_px = 0;
  std::optional<double> focal_35mm;  // EXIF
  std::optional<double> time_s;      // frames of a video
  std::optional<int> frame_index;
  bool needs_conversion =
      false;               // COLMAP cannot read it (16 bits, grey with alpha, HEIC, EXR ...): it gets an 8-bit copy
  std::string given_name;  // what the user calls it, where it is staged under another name (photo_names.h); else empty
};

// The photos to reconstruct from, wherever they came from.
struct Capture {
  std::filesystem::path folder;    // what names are relative to
  std::vector<InputPhoto> photos;  // sorted by name
  std::vector<MissingPhoto> unreadable;
  std::vector<std::string> ignored;  // files that are no pictures
  bool is_video = false;
  bool every_frame = false;  // of a video: not its keyframes only
  bool resampled = false;    // by us: features found in the originals are elsewhere
  int video_frames = 0;      // that could be read

  int total() const { return static_cast<int>(photos.size() + unreadable.size()); }
};

// Searches recursively. Reads headers and checks that files are complete (JPEG: end marker; PNG: end chunk; whatever
// lacks them is decoded). Throws InputError for a folder that is absent or holds no picture.
Capture FindPhotos(const std::filesystem::path& folder, ProgressSink& sink);

// 8-bit copies of what COLMAP cannot read, beside links to the others, in `staging`; returns the capture that COLMAP
// shall see (the same one where nothing needs a copy or another name). A converted photo is named NAME.png; names that
// COLMAP's lists or JSON cannot hold are those of photo_names.h, and a message says so.
Capture StageForColmap(const Capture& capture, const std::filesystem::path& staging, ProgressSink& sink);

// The photos' numbers (frame_000123.jpg: 123) as frames of a video at `fps`. Throws DataError naming the photo without
// one.
void NumberFrames(Capture& capture, double fps);

// Times and frame numbers of the photos for the views of their names; other views stay as they are.
void CopyTimes(const Capture& capture, Scene& scene);

}  // namespace lumi
