// What a picture's file says beside its pixels, as OpenImageIO has read it. Inside the codecs' module only.
#pragma once

#include <OpenImageIO/imageio.h>

#include <filesystem>

#include "scene/files/image_io.h"

namespace lumi {

// format: OpenImageIO's name of it, "jpeg".
ImageInfo PictureInfo(const OIIO::ImageSpec& spec, const std::string& format, const std::filesystem::path& path);

}  // namespace lumi
