// Pictures through OpenImageIO: JPEG PNG EXR TIFF HEIC WebP and more, any bit depth, grey, alpha. EXIF orientation is
// not applied (COLMAP does not either); ReadImageInfo tells it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/model/image.h"

namespace lumi {

struct ImageInfo {
  int width = 0, height = 0, channels = 0;
  std::optional<double> focal_35mm;         // EXIF, millimetres on 35 mm film
  std::optional<std::string> capture_time;  // EXIF, "YYYY:MM:DD hh:mm:ss"
  int orientation = 1;
};

// Is this a name of a picture (by extension)?
bool HasImageExtension(const std::filesystem::path& path);

// Header only. Throws InputError.
ImageInfo ReadImageInfo(const std::filesystem::path& path);

// As RGB (channels = 3) or RGBA (4), 8 bits; grey is spread, 16 bits and float are rounded. A truncated file throws
// InputError: half a photograph is no photograph.
Image8 ReadImage8(const std::filesystem::path& path, int channels = 3);
// As float with the file's own channels (8 bits as 0..1).
ImageF ReadImageF(const std::filesystem::path& path);

// By extension: PNG and JPEG (quality 0..100) from 8 bits, EXR from float. Written atomically.
void WriteImage(const std::filesystem::path& path, const Image8& image, int jpeg_quality = 92);
void WriteImage(const std::filesystem::path& path, const ImageF& image);

// Box-filtered halves, level 0 the image itself, down to 1x1 or `levels`.
std::vector<Image8> BuildPyramid(const Image8& image, int levels = 0);

// Resampled by area averaging (shrinking) or bilinear (growing).
Image8 Resize(const Image8& image, int width, int height);

}  // namespace lumi
