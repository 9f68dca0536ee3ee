#include "scene/files/image_io.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "scene/files/atomic_file.h"
#include "scene/files/codecs.h"
#include "scene/files/file_name.h"
#include "scene/files/open_to_read.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

bool IsJpeg(const fs::path& path) {
  const std::string e = LowerExtension(path);
  return e == ".jpg" || e == ".jpeg" || e == ".jpe";
}

// Chunk by chunk to IEND. libpng would notice as well, but print a line of its own.
bool PngIsComplete(const std::string& bytes) {
  std::size_t i = 8;  // after the signature
  while (bytes.size() >= 12 && i <= bytes.size() - 12) {
    std::size_t length = 0;
    for (std::size_t k = 0; k < 4; ++k) length = length << 8 | static_cast<unsigned char>(bytes[i + k]);
    if (bytes.compare(i + 4, 4, "IEND") == 0) return true;
    i += 12 + length;
  }
  return false;
}

// Decoders fill up a cut-off JPEG with grey and call it done. Walks the segments to the end-of-image marker instead.
bool JpegIsComplete(const std::string& bytes) {
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
  const std::size_t size = bytes.size();
  if (size < 4 || at(0) != 0xFF || at(1) != 0xD8) return false;
  std::size_t i = 2;
  bool scan_seen = false;
  while (i + 1 < size) {
    if (at(i) != 0xFF) {  // entropy-coded data (or stray bytes between segments, which decoders skip as well)
      const std::size_t next = bytes.find('\xFF', i);
      if (next == std::string::npos) return false;
      i = next;
      continue;
    }
    const unsigned marker = at(i + 1);
    if (marker == 0xD9) return scan_seen;
    if (marker == 0xFF) {
      ++i;
    } else if (marker == 0x00 || marker == 0x01 || (marker >= 0xD0 && marker <= 0xD8)) {
      i += 2;
    } else {
      if (i + 3 >= size) return false;
      scan_seen |= marker == 0xDA;
      i += 2 + (static_cast<std::size_t>(at(i + 2)) << 8 | at(i + 3));
    }
  }
  return false;
}

void RequireComplete(const fs::path& path) {
  // By content: names lie.
  char head[4] = {};
  if (std::ifstream in = OpenToRead(path); !in.read(head, sizeof head)) return;  // too short: the decoder says so
  const std::string_view start(head, sizeof head);
  const bool jpeg = start.starts_with("\xFF\xD8\xFF"), png = start == "\x89PNG";
  if (!jpeg && !png) return;
  const std::string bytes = ReadText(path);
  if (jpeg ? !JpegIsComplete(bytes) : !PngIsComplete(bytes))
    throw InputError(path, "is truncated: the picture has no end", "copy it again, or leave it out");
}

void Write(const fs::path& path, const PictureToWrite& picture) {
  LoadCodecs().write(path, picture,
                     {[&](const unsigned char* data, std::size_t size) { WriteBytesAtomically(path, data, size); },
                      [&](const std::function<void(const fs::path&)>& write) { WriteFileAtomically(path, write); }});
}

cv::Mat AsMat(const Image8& image) {
  return {image.height, image.width, CV_8UC(image.channels), const_cast<std::uint8_t*>(image.data.data())};
}

}  // namespace

bool HasImageExtension(const fs::path& path) {
  if (HasRawExtension(path)) return true;
  static constexpr std::array kExtensions{".jpg",  ".jpeg", ".jpe", ".png",  ".exr",  ".tif", ".tiff",
                                          ".heic", ".heif", ".hif", ".avif", ".webp", ".bmp", ".ppm",
                                          ".pgm",  ".pnm",  ".tga", ".jp2",  ".hdr"};
  const std::string e = LowerExtension(path);
  return std::find(kExtensions.begin(), kExtensions.end(), e) != kExtensions.end();
}

bool HasRawExtension(const fs::path& path) {
  // Of OpenImageIO's own list those that are photographs.
  static constexpr std::array kExtensions{".3fr", ".arw", ".cr2", ".cr3", ".crw", ".dcr", ".dng", ".erf", ".fff",
                                          ".iiq", ".kdc", ".mef", ".mos", ".mrw", ".nef", ".nrw", ".orf", ".pef",
                                          ".raf", ".rw2", ".rwl", ".sr2", ".srf", ".srw", ".x3f"};
  const std::string e = LowerExtension(path);
  return std::find(kExtensions.begin(), kExtensions.end(), e) != kExtensions.end();
}

bool CanReadRaw() { return LoadCodecs().can_read_raw(); }

ImageInfo ReadImageInfo(const fs::path& path) { return LoadCodecs().read_info(path); }

Image8 ReadImage8(const fs::path& path, int channels) {
  if (channels != 3 && channels != 4) throw std::invalid_argument("ReadImage8: 3 or 4 channels");
  RequireComplete(path);
  return LoadCodecs().read_8(path, channels);
}

ImageF ReadImageF(const fs::path& path) {
  RequireComplete(path);
  return LoadCodecs().read_float(path);
}

void WriteImage(const fs::path& path, const Image8& image, int jpeg_quality, int orientation) {
  if (image.empty()) throw std::invalid_argument("WriteImage: empty image");
  if (IsJpeg(path) && (image.channels == 2 || image.channels == 4)) {  // JPEG holds no alpha
    Image8 opaque(image.width, image.height, image.channels - 1);
    for (std::size_t i = 0, j = 0; i < image.data.size(); ++i)
      if (i % static_cast<std::size_t>(image.channels) + 1 != static_cast<std::size_t>(image.channels))
        opaque.data[j++] = image.data[i];
    return WriteImage(path, opaque, jpeg_quality, orientation);
  }
  const PictureFormat format = IsJpeg(path)                     ? PictureFormat::kJpeg
                               : LowerExtension(path) == ".png" ? PictureFormat::kPng
                                                                : PictureFormat::kOther;
  Write(path, {image.width, image.height, image.channels, false, image.data.data(), format, jpeg_quality, orientation});
}

void WriteImage(const fs::path& path, const ImageF& image) {
  if (image.empty()) throw std::invalid_argument("WriteImage: empty image");
  Write(path, {image.width, image.height, image.channels, true, image.data.data(), PictureFormat::kOther, 0, 1});
}

Image8 Resize(const Image8& image, int width, int height) {
  if (image.empty() || width <= 0 || height <= 0) throw std::invalid_argument("Resize: empty image or size");
  if (width == image.width && height == image.height) return image;
  // Where one axis grows and the other shrinks, the axes are resampled one after the other, each with its own method.
  if ((width > image.width) != (height > image.height) && width != image.width && height != image.height)
    return Resize(Resize(image, std::min(width, image.width), std::min(height, image.height)), width, height);
  Image8 resized(width, height, image.channels);
  cv::Mat target = AsMat(resized);
  const bool grows = width > image.width || height > image.height;
  cv::resize(AsMat(image), target, target.size(), 0, 0, grows ? cv::INTER_LINEAR : cv::INTER_AREA);
  return resized;
}

std::vector<Image8> BuildPyramid(Image8 image, int levels) {
  std::vector<Image8> pyramid;
  pyramid.push_back(std::move(image));
  while (!pyramid.front().empty() && (levels <= 0 || static_cast<int>(pyramid.size()) < levels)) {
    const Image8& last = pyramid.back();
    if (last.width == 1 && last.height == 1) break;
    Image8 half = Resize(last, std::max(1, last.width / 2), std::max(1, last.height / 2));
    pyramid.push_back(std::move(half));
  }
  return pyramid;
}

}  // namespace lumi
