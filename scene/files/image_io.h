// Pictures through OpenImageIO: JPEG PNG EXR TIFF WebP, cameras' RAW files and more, any bit depth, grey, alpha; HEIC
// and AVIF through libheif, 8 bits.
// EXIF orientation is not applied (cameras are those of the stored pixels, as COLMAP's); ReadImageInfo tells it. HEIC,
// AVIF and RAW come turned as their containers say, so theirs is 1. An embedded ICC profile (Display P3, Adobe RGB ...)
// counts: ReadImage8 gives sRGB, and leaves the pixels of files without a profile, or with sRGB's, as they are.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/model/image.h"

namespace lumi {

struct GpsPosition {
  double latitude_deg = 0, longitude_deg = 0;  // north and east positive
  std::optional<double> altitude_m;
};

// What a file says about a picture beside its pixels, in whatever container: EXIF in JPEG, TIFF, PNG (eXIf), HEIC and
// AVIF; the maker's own data in RAW.
struct ImageInfo {
  int width = 0, height = 0, channels = 0;
  // The focal length's equivalent on 35 mm film, millimetres; where EXIF lacks it, from the focal length and the
  // sensor's size.
  std::optional<double> focal_35mm;
  std::optional<double> focal_mm;           // the lens's own
  std::optional<std::string> capture_time;  // "YYYY:MM:DD hh:mm:ss"
  std::optional<GpsPosition> gps;
  std::string make, model, lens;
  int orientation = 1;     // 1 to 8, of the pixels as they are read
  bool panorama = false;   // EXIF: stitched by the camera
  std::string projection;  // XMP's GPano:ProjectionType, "equirectangular"
};

// Is this a name of a picture (by extension)?
bool HasImageExtension(const std::filesystem::path& path);
// ... of a camera's RAW file (by extension), and can such files be read here?
bool HasRawExtension(const std::filesystem::path& path);
bool CanReadRaw();

// Header only. Throws InputError.
ImageInfo ReadImageInfo(const std::filesystem::path& path);

// As RGB (channels = 3) or RGBA (4), 8 bits; grey is spread, 16 bits and float are rounded. A truncated file throws
// InputError: half a photograph is no photograph.
Image8 ReadImage8(const std::filesystem::path& path, int channels = 3);
// As float with the file's own channels (8 bits as 0..1).
ImageF ReadImageF(const std::filesystem::path& path);

// By extension: PNG and JPEG (quality 0..100) from 8 bits, EXR from float. Written atomically. orientation: EXIF's, of
// JPEG and TIFF.
void WriteImage(const std::filesystem::path& path, const Image8& image, int jpeg_quality = 92, int orientation = 1);
void WriteImage(const std::filesystem::path& path, const ImageF& image);

// Box-filtered halves, level 0 the image itself, down to 1x1 or `levels`.
std::vector<Image8> BuildPyramid(Image8 image, int levels = 0);

// Resampled by area averaging (shrinking) or bilinear (growing).
Image8 Resize(const Image8& image, int width, int height);

}  // namespace lumi
