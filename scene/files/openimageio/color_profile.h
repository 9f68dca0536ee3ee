// Colours of photographs in profiles other than sRGB (phones' Display P3, cameras' Adobe RGB) brought to sRGB, by
// little CMS. Inside the codecs' module only.
#pragma once

#include <OpenImageIO/imageio.h>

#include <filesystem>
#include <string>

#include "scene/model/image.h"

namespace lumi {

// The ICC profile embedded in a file, as bytes; empty: it has none. HEIC and AVIF profiles are read here, because
// OpenImageIO does not give them; such files may name their colours by numbers (nclx) instead, and for Display P3 a
// profile is made from these. Likewise for the Adobe RGB of cameras' JPEGs, which EXIF alone tells.
std::string EmbeddedProfile(const OIIO::ImageSpec& spec, const std::string& format, const std::filesystem::path& path);

// RGB or RGBA. Relative colorimetric. Pixels stay as they are under sRGB's own profile (two code values from it or
// less), under a profile that is not for RGB, and under one that cannot be read.
void ToSrgb(const std::string& profile, Image8& image);

}  // namespace lumi
