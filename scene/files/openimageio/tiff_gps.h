// Where a TIFF was taken, and a RAW photo whose container is one (DNG, NEF, ARW, CR2): OpenImageIO 2.4 reads the GPS
// fields of EXIF from JPEG, PNG and HEIF, not from TIFF. Fields: EXIF 2.32 (CIPA DC-008), section 4.6.6; TIFF 6.0,
// section 2.
#pragma once

#include <filesystem>
#include <optional>

#include "scene/files/image_io.h"

namespace lumi {

// Nothing: no TIFF, no position, or one that is none.
std::optional<GpsPosition> TiffGps(const std::filesystem::path& path);

}  // namespace lumi
