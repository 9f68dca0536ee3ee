// What pictures are decoded and encoded with. Inside scene/files only.
//
// OpenImageIO brings 250 shared libraries, which take the loader a quarter of a second, in every program, also in those
// that only say what is wrong with an option. They stand in a module beside the programs (openimageio/) that is
// loaded when the first picture is opened. Video has a module of its own: video_codecs.h.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>

#include "scene/files/image_io.h"

namespace lumi {

enum class PictureFormat { kJpeg, kPng, kOther };

struct PictureToWrite {
  int width = 0, height = 0, channels = 0;
  bool is_float = false;  // else 8 bits
  const void* pixels = nullptr;
  PictureFormat format = PictureFormat::kOther;
  int jpeg_quality = 0;
  int orientation = 1;  // EXIF's
};

// Takes what was encoded: as bytes, or, from formats that must have a file, by a function that writes one.
struct PictureSink {
  std::function<void(const unsigned char* data, std::size_t size)> bytes;
  std::function<void(const std::function<void(const std::filesystem::path&)>& write)> file;
};

// They throw what image_io.h says.
struct Codecs {
  ImageInfo (*read_info)(const std::filesystem::path&);
  bool (*can_read_raw)();
  Image8 (*read_8)(const std::filesystem::path&, int channels);
  ImageF (*read_float)(const std::filesystem::path&);
  void (*write)(const std::filesystem::path&, const PictureToWrite&, const PictureSink&);
};

// Throws MachineError where the module is missing.
const Codecs& LoadCodecs();

}  // namespace lumi
