// Colours of photographs in profiles other than sRGB (phones' Display P3, cameras' Adobe RGB) brought to sRGB, by
// little CMS. Inside the codecs' module only.
#pragma once

#include <OpenImageIO/imageio.h>

#include <filesystem>
#include <string>

#include "scene/files/libheif/heif_picture.h"
#include "scene/model/image.h"

namespace lumi {

// The ICC profile embedded in a file, as bytes; empty: it has none. One is made for the Adobe RGB of cameras' JPEGs,
// which EXIF alone tells.
std::string EmbeddedProfile(const OIIO::ImageSpec& spec, const std::string& format, const std::filesystem::path& path);
// Likewise; one is made where HEIC or AVIF names Display P3 by numbers (nclx).
std::string ProfileOf(const HeifPicture& picture);

// RGB or RGBA. Relative colorimetric. Pixels stay as they are under sRGB's own profile (two code values from it or
// less), under a profile that is not for RGB, and under one that cannot be read.
void ToSrgb(const std::string& profile, Image8& image);

}  // namespace lumi
