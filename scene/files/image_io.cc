#include "scene/files/image_io.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "scene/files/file_name.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// A picture of more pixels than any photograph is a decompression bomb or a corrupt header.
constexpr std::int64_t kMaxPixels = std::int64_t(1) << 29;
constexpr int kMaxSide = 65500;
// From so many pixels on, a file must have a byte for every so many of them: no format packs a real photograph tighter,
// and a header that lies must not get gigabytes.
constexpr std::int64_t kManyPixels = std::int64_t(1) << 24;
constexpr std::int64_t kPixelsPerByte = 2000;
constexpr int kMaxChannels = 64;
// PNG: a fifth of the default's (6, filters off) time on photographs, for a fifth more bytes.
constexpr int kPngCompression = 2;
constexpr int kPngFilterSub = 0x10;
constexpr int kFullChromaQuality = 95;  // JPEG: from here on colour keeps its full resolution too

bool IsJpeg(const fs::path& path) {
  const std::string e = LowerExtension(path);
  return e == ".jpg" || e == ".jpeg" || e == ".jpe";
}

// OpenImageIO's messages may have several lines; ours have one.
std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  return text;
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
  if (std::ifstream in(path, std::ios::binary); !in.read(head, sizeof head)) return;  // too short: the decoder says so
  const std::string_view start(head, sizeof head);
  const bool jpeg = start.starts_with("\xFF\xD8\xFF"), png = start == "\x89PNG";
  if (!jpeg && !png) return;
  const std::string bytes = ReadText(path);
  if (jpeg ? !JpegIsComplete(bytes) : !PngIsComplete(bytes))
    throw InputError(path, "is truncated: the picture has no end", "copy it again, or leave it out");
}

// Pictures are read and written side by side by whoever has many: one thread each, none more inside.
void LimitThreads() {
  static const bool done = OIIO::attribute("threads", 1);
  static_cast<void>(done);
}

std::unique_ptr<OIIO::ImageInput> Open(const fs::path& path) {
  LimitThreads();
  std::error_code error;
  if (!fs::exists(path, error)) throw InputError(path, "there is no such picture");
  if (fs::is_directory(path, error)) throw InputError(path, "is a folder, not a picture");
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // colours as they are in the file, also where transparent
  auto in = OIIO::ImageInput::open(path.string(), &config);
  if (!in) {
    const std::string why = OneLine(OIIO::geterror());
    throw InputError(path, fmt::format("is not a picture that can be read{}{}", why.empty() ? "" : ": ", why));
  }
  const OIIO::ImageSpec& spec = in->spec();
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.width > kMaxSide || spec.height > kMaxSide ||
      spec.nchannels > kMaxChannels || static_cast<std::int64_t>(spec.width) * spec.height > kMaxPixels || spec.depth > 1)
    throw InputError(path, fmt::format("{} x {} pixels with {} channels cannot be a photograph", spec.width, spec.height, spec.nchannels));
  const std::int64_t pixels = static_cast<std::int64_t>(spec.width) * spec.height;
  if (const auto bytes = static_cast<std::int64_t>(fs::file_size(path, error)); !error && pixels > kManyPixels && pixels / kPixelsPerByte > bytes)
    throw InputError(path, fmt::format("claims {} x {} pixels in {} bytes: the file is cut off or corrupt", spec.width, spec.height, bytes));
  return in;
}

template <typename T>
Image<T> ReadPixels(OIIO::ImageInput& in, const fs::path& path, OIIO::TypeDesc type) {
  const OIIO::ImageSpec spec = in.spec();
  Image<T> image(spec.width, spec.height, spec.nchannels);
  const bool read = in.read_image(0, 0, 0, spec.nchannels, type, image.data.data());
  if (!read || in.has_error()) {
    const std::string why = OneLine(in.geterror());
    throw InputError(path, fmt::format("is truncated or corrupt{}{}", why.empty() ? "" : ": ", why), "copy it again, or leave it out");
  }
  return image;
}

std::uint8_t ToCode(std::uint8_t v) { return v; }
std::uint8_t ToCode(std::uint16_t v) { return static_cast<std::uint8_t>((v * 255u + 32767u) / 65535u); }
std::uint8_t ToCode(float v) {
  if (!(v > 0)) return 0;  // also not a number
  return v >= 1 ? 255 : static_cast<std::uint8_t>(v * 255.0f + 0.5f);
}

// Which channels of the file become red, green, blue and alpha (-1: none, opaque).
std::array<int, 4> ChannelsOf(const OIIO::ImageSpec& spec) {
  const int n = spec.nchannels;
  int alpha = spec.alpha_channel >= 0 && spec.alpha_channel < n ? spec.alpha_channel : -1;
  if (alpha < 0 && (n == 2 || n == 4)) alpha = n - 1;
  if (n < 3) return {0, 0, 0, n == 2 ? alpha : -1};
  return {0, 1, 2, alpha};
}

template <typename T>
Image8 ToImage8(const Image<T>& source, const std::array<int, 4>& from, int channels) {
  Image8 image(source.width, source.height, channels);
  const std::size_t pixels = static_cast<std::size_t>(source.width) * static_cast<std::size_t>(source.height);
  const T* s = source.data.data();
  std::uint8_t* d = image.data.data();
  for (std::size_t i = 0; i < pixels; ++i, s += source.channels, d += channels)
    for (int c = 0; c < channels; ++c) {
      const int k = from[static_cast<std::size_t>(c)];
      d[c] = k < 0 ? 255 : ToCode(s[k]);
    }
  return image;
}

void Encode(const fs::path& path, const OIIO::ImageSpec& spec, OIIO::TypeDesc type, const void* pixels) {
  LimitThreads();
  auto out = OIIO::ImageOutput::create(path.string());
  if (!out) {
    OIIO::geterror();
    throw UsageError(fmt::format("{}: pictures cannot be written with the ending \"{}\"", path.string(), path.extension().string()),
                     "use .png, .jpg or .exr");
  }
  const auto write = [&](const std::string& name, OIIO::Filesystem::IOProxy* proxy) {
    if (proxy) out->set_ioproxy(proxy);
    const bool done = out->open(name, spec) && out->write_image(type, pixels) && out->close();
    if (!done)
      throw MachineError(fmt::format("cannot write the picture: {}", OneLine(out->geterror())), "is the disk full?", path);
  };
  // Encoded in memory where the format allows: then the disk's answer to every byte is ours to check.
  if (out->supports("ioproxy")) {
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    write(path.string(), &memory);
    WriteBytesAtomically(path, bytes.data(), bytes.size());
  } else {
    WriteFileAtomically(path, [&](const fs::path& temporary) { write(temporary.string(), nullptr); });
  }
}

cv::Mat AsMat(const Image8& image) {
  return {image.height, image.width, CV_8UC(image.channels), const_cast<std::uint8_t*>(image.data.data())};
}

}  // namespace

bool HasImageExtension(const fs::path& path) {
  static constexpr std::array kExtensions{".jpg", ".jpeg", ".jpe", ".png", ".exr", ".tif", ".tiff", ".heic", ".heif", ".avif",
                                          ".webp", ".bmp", ".ppm", ".pgm", ".pnm", ".tga", ".jp2", ".hdr"};
  const std::string e = LowerExtension(path);
  return std::find(kExtensions.begin(), kExtensions.end(), e) != kExtensions.end();
}

ImageInfo ReadImageInfo(const fs::path& path) {
  const auto in = Open(path);
  const OIIO::ImageSpec& spec = in->spec();
  ImageInfo info;
  info.width = spec.width;
  info.height = spec.height;
  info.channels = spec.nchannels;
  info.orientation = std::clamp(spec.get_int_attribute("Orientation", 1), 1, 8);
  if (const float f = spec.get_float_attribute("Exif:FocalLengthIn35mmFilm", 0); f > 0 && std::isfinite(f)) info.focal_35mm = f;
  for (const char* name : {"Exif:DateTimeOriginal", "DateTime"})
    if (const std::string time(spec.get_string_attribute(name)); !time.empty() && !info.capture_time) info.capture_time = time;
  return info;
}

Image8 ReadImage8(const fs::path& path, int channels) {
  if (channels != 3 && channels != 4) throw std::invalid_argument("ReadImage8: 3 or 4 channels");
  RequireComplete(path);
  const auto in = Open(path);
  const OIIO::ImageSpec spec = in->spec();
  const auto from = ChannelsOf(spec);
  if (spec.format == OIIO::TypeDesc::UINT8) {
    Image8 image = ReadPixels<std::uint8_t>(*in, path, OIIO::TypeDesc::UINT8);
    if (spec.nchannels == channels && (channels == 3 || from[3] == 3)) return image;
    return ToImage8(image, from, channels);
  }
  if (spec.format == OIIO::TypeDesc::UINT16)
    return ToImage8(ReadPixels<std::uint16_t>(*in, path, OIIO::TypeDesc::UINT16), from, channels);
  return ToImage8(ReadPixels<float>(*in, path, OIIO::TypeDesc::FLOAT), from, channels);
}

ImageF ReadImageF(const fs::path& path) {
  RequireComplete(path);
  const auto in = Open(path);
  return ReadPixels<float>(*in, path, OIIO::TypeDesc::FLOAT);
}

void WriteImage(const fs::path& path, const Image8& image, int jpeg_quality) {
  if (image.empty()) throw std::invalid_argument("WriteImage: empty image");
  if (IsJpeg(path) && (image.channels == 2 || image.channels == 4)) {  // JPEG holds no alpha
    Image8 opaque(image.width, image.height, image.channels - 1);
    for (std::size_t i = 0, j = 0; i < image.data.size(); ++i)
      if (i % static_cast<std::size_t>(image.channels) + 1 != static_cast<std::size_t>(image.channels)) opaque.data[j++] = image.data[i];
    return WriteImage(path, opaque, jpeg_quality);
  }
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  spec.attribute("oiio:ColorSpace", "sRGB");
  if (IsJpeg(path)) {
    spec.attribute("Compression", fmt::format("jpeg:{}", std::clamp(jpeg_quality, 1, 100)));
    spec.attribute("jpeg:subsampling", jpeg_quality >= kFullChromaQuality ? "4:4:4" : "4:2:0");
  } else if (LowerExtension(path) == ".png") {
    spec.attribute("png:compressionLevel", kPngCompression);
    spec.attribute("png:filter", kPngFilterSub);
  }
  Encode(path, spec, OIIO::TypeDesc::UINT8, image.data.data());
}

void WriteImage(const fs::path& path, const ImageF& image) {
  if (image.empty()) throw std::invalid_argument("WriteImage: empty image");
  OIIO::ImageSpec spec(image.width, image.height, image.channels, OIIO::TypeDesc::FLOAT);
  Encode(path, spec, OIIO::TypeDesc::FLOAT, image.data.data());
}

Image8 Resize(const Image8& image, int width, int height) {
  if (image.empty() || width <= 0 || height <= 0) throw std::invalid_argument("Resize: empty image or size");
  if (width == image.width && height == image.height) return image;
  // One axis after the other where one grows and the other shrinks: each in its own way.
  if ((width > image.width) != (height > image.height) && width != image.width && height != image.height)
    return Resize(Resize(image, std::min(width, image.width), std::min(height, image.height)), width, height);
  Image8 resized(width, height, image.channels);
  cv::Mat target = AsMat(resized);
  const bool grows = width > image.width || height > image.height;
  cv::resize(AsMat(image), target, target.size(), 0, 0, grows ? cv::INTER_LINEAR : cv::INTER_AREA);
  return resized;
}

std::vector<Image8> BuildPyramid(const Image8& image, int levels) {
  std::vector<Image8> pyramid{image};
  while (!image.empty() && (levels <= 0 || static_cast<int>(pyramid.size()) < levels)) {
    const Image8& last = pyramid.back();
    if (last.width == 1 && last.height == 1) break;
    pyramid.push_back(Resize(last, std::max(1, last.width / 2), std::max(1, last.height / 2)));
  }
  return pyramid;
}

}  // namespace lumi
