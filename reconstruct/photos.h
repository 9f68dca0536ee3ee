// Which files of a folder are photographs that can be used; the others, with reasons. Nothing is written here.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/options.h"
#include "scene/files/image_io.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

// COLMAP's rule for EXIF's focal length: px = its film equivalent / 35 mm * the photo's longer side.
inline constexpr double kFilm35WidthMm = 35;

struct InputPhoto {
  std::string name;      // relative to the folder, with '/'
  std::string original;  // its name in the user's folder, where `name` is a copy's, or staged (photo_names.h)
  int width_px = 0, height_px = 0;
  std::optional<double> focal_35mm, focal_mm;  // EXIF
  std::optional<GpsPosition> gps;              // EXIF
  std::string camera, lens;                    // EXIF: make and model
  std::string projection;                      // XMP: "equirectangular"
  bool panorama = false;                       // EXIF: stitched by the camera
  int orientation = 1;                         // EXIF: which side of the stored pixels is up
  std::optional<double> time_s;                // frames of a video
  std::optional<int> frame_index;
  bool needs_conversion =
      false;  // COLMAP cannot read it (16 bits, grey with alpha, HEIC, RAW, EXR ...): it gets an 8-bit copy

  const std::string& OriginalName() const { return original.empty() ? name : original; }
};

// What EXIF says of the lens as it was set: photos that agree in it may share a camera.
std::string LensSetting(const InputPhoto& photo);

// The photos to reconstruct from, wherever they came from.
struct Capture {
  std::filesystem::path folder;     // what names are relative to
  std::filesystem::path originals;  // ... original names, where `folder` holds converted copies
  std::vector<InputPhoto> photos;   // sorted by name
  std::vector<MissingPhoto> unreadable;
  std::vector<std::string> ignored;  // files that are no pictures
  bool is_video = false;
  bool every_frame = false;  // of a video: not its keyframes only
  bool resampled = false;    // by us: features found in the originals are elsewhere
  int video_frames = 0;      // that could be read

  int total() const { return static_cast<int>(photos.size() + unreadable.size()); }
};

// Searches recursively. Reads headers and checks that files are complete (JPEG: end marker; PNG: end chunk; whatever
// lacks them is decoded, RAW files when they are converted). A RAW file beside the picture that the camera or somebody
// made of it is left out. Throws InputError for a folder that is absent or holds no picture.
Capture FindPhotos(const std::filesystem::path& folder, ProgressSink& sink);

// 8-bit copies of what COLMAP cannot read, beside links to the others, in `staging`; returns the capture that COLMAP
// shall see (the same one where nothing needs a copy or another name). A converted photo is named NAME.png, of HEIC and
// AVIF NAME.jpg; names that COLMAP's lists or JSON cannot hold are those of photo_names.h, and a message says so. A
// converted photo that turns out to be unreadable is left out.
Capture StageForColmap(const Capture& capture, const std::filesystem::path& staging, ProgressSink& sink);

// The photos' numbers (frame_000123.jpg: 123) as frames of a video at `fps`. Throws DataError naming the photo without
// one.
void NumberFrames(Capture& capture, double fps);

// Times, frame numbers and orientations of the photos for the views of their names; other views stay as they are.
void CopyPhotoFacts(const Capture& capture, Scene& scene);

}  // namespace lumi
