// What pictures and videos are decoded and encoded with. Inside scene/files only.
//
// OpenImageIO and OpenCV's video reader bring 250 shared libraries, which take the loader a quarter of a second, in
// every program, also in those that only say what is wrong with an option. They stand in a module beside the programs
// (codecs_module.cc) that is loaded when the first picture or video is opened.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>

#include "scene/files/image_io.h"

namespace cv {
class Mat;
}

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

// As cv::VideoCapture.
struct VideoDecoder {
  virtual ~VideoDecoder() = default;
  virtual bool Grab() = 0;
  virtual bool Retrieve(cv::Mat& bgr) = 0;
  virtual double TimeMs() = 0;  // of the frame just grabbed, as the container states it
};
struct VideoClaims {
  double fps = 0, frames = 0;
  int width = 0, height = 0;
};

// They throw what image_io.h says. open_video gives null where it cannot, or throws cv::Exception.
struct Codecs {
  ImageInfo (*read_info)(const std::filesystem::path&);
  bool (*can_read_raw)();
  Image8 (*read_8)(const std::filesystem::path&, int channels);
  ImageF (*read_float)(const std::filesystem::path&);
  void (*write)(const std::filesystem::path&, const PictureToWrite&, const PictureSink&);
  std::unique_ptr<VideoDecoder> (*open_video)(const std::filesystem::path&, VideoClaims*);
};

// Throws MachineError where the module is missing.
const Codecs& LoadCodecs();

}  // namespace lumi
