// Colours of photographs in profiles other than sRGB (phones' Display P3, cameras' Adobe RGB) brought to sRGB, by
// little CMS. Inside the codecs' module only.
#pragma once

#include <OpenImageIO/imageio.h>

#include <filesystem>
#include <string>

#include "scene/model/image.h"

namespace lumi {

// The ICC profile embedded in a file, as bytes; empty: it has none. HEIC's and AVIF's is read here, for OpenImageIO
// does not tell it; theirs may be in words (nclx), of which Display P3 becomes a profile.
std::string EmbeddedProfile(const OIIO::ImageSpec& spec, const std::string& format, const std::filesystem::path& path);

// RGB or RGBA. Relative colorimetric. Nothing is touched under sRGB's own profile (two code values from it or less),
// one that is not of RGB, and one that cannot be read.
void ToSrgb(const std::string& profile, Image8& image);

}  // namespace lumi
