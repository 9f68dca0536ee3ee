// HEIC and AVIF by libheif itself, because OpenImageIO 2.4's reader believes the size that the container states and
// reads beyond a coded picture that is smaller. Inside the codecs' module only.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "scene/model/image.h"

struct heif_context;
struct heif_image_handle;

namespace lumi {

// A file's primary picture, turned and cropped as its container says. What it knows before Pixels() is read from the
// container, not decoded.
class HeifPicture {
 public:
  // Null where the content is no ISO base media file, or a camera's RAW (CR3). Throws InputError.
  static std::unique_ptr<HeifPicture> Open(const std::filesystem::path& path);

  int width() const;  // pixels, as the container states them: not to be trusted before Pixels() returned
  int height() const;
  int channels() const;  // 3, or 4 with alpha

  // EXIF as a TIFF directory; empty: none.
  std::string Exif() const;
  // An ICC profile's bytes; empty: none.
  std::string Profile() const;
  // Colours named by numbers: Display P3's primaries with sRGB's curve.
  bool IsDisplayP3() const;

  // channels: 3 or 4; 8 bits. Throws InputError where it cannot be decoded or has another size than was stated.
  Image8 Pixels(int channels) const;

 private:
  struct Free {
    void operator()(heif_context* context) const;
    void operator()(heif_image_handle* handle) const;
  };
  HeifPicture() = default;

  std::filesystem::path path_;
  std::unique_ptr<heif_context, Free> context_;
  std::unique_ptr<heif_image_handle, Free> handle_;
};

}  // namespace lumi
