// Photos and films as phones write them: HEIC that its container turns upright; HEVC by BT.709 that its display matrix
// turns, with frames that come when they come.
#pragma once

#include <filesystem>
#include <string>

#include "scene/model/image.h"

namespace lumi::test {

// Whether this machine's libraries can encode them: libheif's HEVC encoder, ffmpeg with libx265.
bool CanWriteHeic();
bool CanWriteHevc();

// The stored pixels as they are, and in the container how a reader turns them upright (EXIF's orientation: 1, 3, 6, 8).
// focal_35mm: EXIF's FocalLengthIn35mmFilm. Throws std::runtime_error.
void WriteHeic(const std::filesystem::path& path, const Image8& stored, int orientation, int focal_35mm);

// Of a film's frames those that ffmpeg's expression `frames` of n takes, each at its own time ("1": all). They are
// stored lying on their side, and the display matrix turns them back.
void WritePhoneFilm(const std::filesystem::path& film, const std::string& frames, const std::filesystem::path& out);

}  // namespace lumi::test
