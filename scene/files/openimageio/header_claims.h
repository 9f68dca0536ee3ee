// What a picture's header claims, read before a decoder sees the file: decoders that take what is claimed while they
// open the file cannot be asked first.
#pragma once

#include <filesystem>
#include <optional>

namespace lumi {

struct ClaimedSize {
  int width = 0, height = 0;  // pixels
};

// Of a WebP. Nothing: another format, or too short for one. Container: developers.google.com/speed/webp, "RIFF
// Container"; VP8's frame header: RFC 6386, section 9.1; VP8L's: RFC 9649, section 3.4.
std::optional<ClaimedSize> WebpSize(const std::filesystem::path& path);

// Whether an OpenEXR file has an attribute that is longer than the whole file (openexr.com, "OpenEXR File Layout").
// False for other formats.
bool ExrAttributeBeyondFile(const std::filesystem::path& path);

}  // namespace lumi
