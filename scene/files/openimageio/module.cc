// The module that LoadCodecs opens: pictures by OpenImageIO, HEIC and AVIF by libheif.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/tiffutils.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

#include "scene/files/codecs.h"
#include "scene/files/libheif/heif_picture.h"
#include "scene/files/one_line.h"
#include "scene/files/open_to_read.h"
#include "scene/files/openimageio/color_profile.h"
#include "scene/files/openimageio/header_claims.h"
#include "scene/files/openimageio/picture_info.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// A picture of more pixels than any photograph is a decompression bomb or a corrupt header.
constexpr std::int64_t kMaxPixels = std::int64_t(1) << 29;
constexpr int kMaxSide = 65500;
// Above kManyPixels, a file must have at least one byte for every kPixelsPerByte pixels: no format packs a real
// photograph tighter, and a wrong header must not make us allocate gigabytes.
constexpr std::int64_t kManyPixels = std::int64_t(1) << 24;
constexpr std::int64_t kPixelsPerByte = 2000;
constexpr std::int64_t kManyValues = 4 * kManyPixels, kValuesPerByte = 4 * kPixelsPerByte;  // of all channels
constexpr int kMaxChannels = 64;
// PNG: a fifth of the default's (6, filters off) time on photographs, for a fifth more bytes.
constexpr int kPngCompression = 2;
constexpr int kPngFilterSub = 0x10;
constexpr int kFullChromaQuality = 95;  // JPEG: from here on colour keeps its full resolution too

// Callers with many pictures read and write them in parallel, so that OpenImageIO itself gets one thread. OpenEXR gets
// none of its own: where memory runs out, it would wait for ever for a task that none of them was given.
void LimitThreads() {
  static const bool done = OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
  static_cast<void>(done);
}

// The name or format to open a file by. OpenImageIO takes a '?' in a file's name for the beginning of arguments; such
// files are opened by their format.
std::string FormatName(const fs::path& path) {
  const std::string ending = path.extension().string();
  return path.string().find('?') == std::string::npos || ending.size() < 2 ? path.string() : ending.substr(1);
}

std::unique_ptr<OIIO::ImageInput> OpenInput(const fs::path& path, const OIIO::ImageSpec& config) {
  const std::string format = FormatName(path);
  if (format == path.string()) return OIIO::ImageInput::open(format, &config);
  auto in = OIIO::ImageInput::create(format);
  OIIO::ImageSpec spec;
  return in && in->open(path.string(), spec, config) ? std::move(in) : nullptr;
}

// Throws where a header claims what no photograph is, or more than its file can hold.
void RequirePhotograph(const fs::path& path, int width, int height, int channels, int depth) {
  const std::int64_t pixels = static_cast<std::int64_t>(width) * height, values = pixels * channels;
  if (width <= 0 || height <= 0 || channels <= 0 || width > kMaxSide || height > kMaxSide || channels > kMaxChannels ||
      pixels > kMaxPixels || depth > 1)
    throw InputError(path,
                     fmt::format("{} x {} pixels with {} channels cannot be a photograph", width, height, channels));
  std::error_code error;
  if (const auto bytes = static_cast<std::int64_t>(fs::file_size(path, error));
      !error && ((pixels > kManyPixels && pixels / kPixelsPerByte > bytes) ||
                 (values > kManyValues && values / kValuesPerByte > bytes)))
    throw InputError(
        path, fmt::format("claims {} x {} pixels with {} channels in {} bytes: the file is cut off or corrupt", width,
                          height, channels, bytes));
}

void RequireFile(const fs::path& path) {
  std::error_code error;
  if (!fs::exists(path, error)) throw InputError(path, "there is no such picture");
  if (fs::is_directory(path, error)) throw InputError(path, "is a folder, not a picture");
}

// Null where it is no such file.
std::unique_ptr<HeifPicture> OpenHeif(const fs::path& path) {
  RequireFile(path);
  auto heif = HeifPicture::Open(path);
  if (heif) RequirePhotograph(path, heif->width(), heif->height(), heif->channels(), 1);
  return heif;
}

std::unique_ptr<OIIO::ImageInput> Open(const fs::path& path) {
  LimitThreads();
  RequireFile(path);
  if (const auto size = WebpSize(path)) RequirePhotograph(path, size->width, size->height, 3, 1);
  if (ExrAttributeBeyondFile(path))
    throw InputError(path, "is truncated or corrupt: its header claims more than the file");
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // colours as they are in the file, also where transparent
  errno = 0;
  auto in = OpenInput(path, config);
  if (!in) {
    ThrowIfMachineIsShort(path, errno);
    const std::string why = OneLine(OIIO::geterror());
    throw InputError(path, fmt::format("is not a picture that can be read{}{}", why.empty() ? "" : ": ", why));
  }
  if (std::string_view(in->format_name()) == "heif")  // which OpenHeif knows by its beginning
    throw InputError(path, "is not a picture that can be read: the file type is not at its beginning");
  const OIIO::ImageSpec& spec = in->spec();
  RequirePhotograph(path, spec.width, spec.height, spec.nchannels, spec.depth);
  return in;
}

template <typename T>
Image<T> ReadPixels(OIIO::ImageInput& in, const fs::path& path, OIIO::TypeDesc type) {
  const OIIO::ImageSpec spec = in.spec();
  Image<T> image(spec.width, spec.height, spec.nchannels);
  const bool read = in.read_image(0, 0, 0, spec.nchannels, type, image.data.data());
  if (!read || in.has_error()) {
    const std::string why = OneLine(in.geterror());
    throw InputError(path, fmt::format("is truncated or corrupt{}{}", why.empty() ? "" : ": ", why),
                     "copy it again, or leave it out");
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

ImageInfo ReadInfo(const fs::path& path) {
  if (const auto heif = OpenHeif(path)) {
    OIIO::ImageSpec spec(heif->width(), heif->height(), heif->channels(), OIIO::TypeDesc::UINT8);
    if (const std::string exif = heif->Exif(); !exif.empty()) OIIO::decode_exif(exif, spec);
    return PictureInfo(spec, "heif", path);
  }
  const auto in = Open(path);
  return PictureInfo(in->spec(), in->format_name(), path);
}

bool CanReadRawFiles() {
  // "bmp,cineon,dds,...": the formats that this OpenImageIO was built with.
  LimitThreads();
  const std::string formats(OIIO::get_string_attribute("format_list"));
  return ("," + formats + ",").find(",raw,") != std::string::npos;
}

Image8 Pixels8(OIIO::ImageInput& in, const fs::path& path, int channels) {
  const OIIO::ImageSpec spec = in.spec();
  const auto from = ChannelsOf(spec);
  if (spec.format == OIIO::TypeDesc::UINT8) {
    Image8 image = ReadPixels<std::uint8_t>(in, path, OIIO::TypeDesc::UINT8);
    if (spec.nchannels == channels && (channels == 3 || from[3] == 3)) return image;
    return ToImage8(image, from, channels);
  }
  if (spec.format == OIIO::TypeDesc::UINT16)
    return ToImage8(ReadPixels<std::uint16_t>(in, path, OIIO::TypeDesc::UINT16), from, channels);
  return ToImage8(ReadPixels<float>(in, path, OIIO::TypeDesc::FLOAT), from, channels);
}

Image8 Read8(const fs::path& path, int channels) {
  if (const auto heif = OpenHeif(path)) {
    Image8 image = heif->Pixels(channels);
    ToSrgb(ProfileOf(*heif), image);
    return image;
  }
  const auto in = Open(path);
  const std::string profile = EmbeddedProfile(in->spec(), in->format_name(), path);
  Image8 image = Pixels8(*in, path, channels);
  ToSrgb(profile, image);
  return image;
}

ImageF ReadF(const fs::path& path) {
  if (const auto heif = OpenHeif(path)) {
    const Image8 codes = heif->Pixels(heif->channels());
    ImageF image(codes.width, codes.height, codes.channels);
    std::transform(codes.data.begin(), codes.data.end(), image.data.begin(),
                   [](std::uint8_t code) { return static_cast<float>(code) / 255.0f; });
    return image;
  }
  const auto in = Open(path);
  return ReadPixels<float>(*in, path, OIIO::TypeDesc::FLOAT);
}

void Write(const fs::path& path, const PictureToWrite& picture, const PictureSink& sink) {
  LimitThreads();
  const OIIO::TypeDesc type = picture.is_float ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8;
  OIIO::ImageSpec spec(picture.width, picture.height, picture.channels, type);
  if (!picture.is_float) {
    spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("oiio:ColorSpace", "sRGB");
    if (picture.orientation != 1) spec.attribute("Orientation", picture.orientation);
  }
  if (picture.format == PictureFormat::kJpeg) {
    spec.attribute("Compression", fmt::format("jpeg:{}", std::clamp(picture.jpeg_quality, 1, 100)));
    spec.attribute("jpeg:subsampling", picture.jpeg_quality >= kFullChromaQuality ? "4:4:4" : "4:2:0");
  } else if (picture.format == PictureFormat::kPng) {
    spec.attribute("png:compressionLevel", kPngCompression);
    spec.attribute("png:filter", kPngFilterSub);
  }
  // A fixed time, so that the same picture always gives the same bytes.
  if (path.extension() == ".exr") spec.attribute("DateTime", "1970:01:01 00:00:00");
  auto out = OIIO::ImageOutput::create(FormatName(path));
  if (!out) {
    OIIO::geterror();
    throw UsageError(
        fmt::format("{}: pictures cannot be written with the ending \"{}\"", path.string(), path.extension().string()),
        "use .png, .jpg or .exr");
  }
  const auto write = [&](const std::string& name, OIIO::Filesystem::IOProxy* proxy) {
    if (proxy) out->set_ioproxy(proxy);
    bool done = false;
    try {
      done = out->open(name, spec) && out->write_image(type, picture.pixels) && out->close();
    } catch (...) {
      // Out of memory. What was opened half (a JPEG) crashes where it is closed, so it is left as it is.
      static_cast<void>(out.release());
      throw;
    }
    if (!done)
      throw MachineError(fmt::format("cannot write the picture: {}", OneLine(out->geterror())), "is the disk full?",
                         path);
  };
  // Encoded in memory where the format allows: then the disk's answer to every byte is ours to check. TIFF's directory
  // is lost there (OpenImageIO 2.4).
  if (out->supports("ioproxy") && std::string_view(out->format_name()) != "tiff") {
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    write(path.string(), &memory);
    sink.bytes(bytes.data(), bytes.size());
  } else {
    sink.file([&](const fs::path& temporary) { write(temporary.string(), nullptr); });
  }
}

constexpr Codecs kCodecs{ReadInfo, CanReadRawFiles, Read8, ReadF, Write};

}  // namespace
}  // namespace lumi

extern "C" __attribute__((visibility("default"))) const lumi::Codecs* LumigraphCodecs() { return &lumi::kCodecs; }
