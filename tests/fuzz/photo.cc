// A photo's header and pixels. OpenImageIO is not instrumented: what is looked at here is what our door makes of it.
#include <cmath>

#include "scene/files/image_io.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(photo) {
  const std::filesystem::path file = InputFile("photo.jpg", bytes);  // other formats are found by their content
  const ImageInfo info = ReadImageInfo(file);
  Require(info.width > 0 && info.height > 0 && info.orientation >= 1 && info.orientation <= 8, "a size of nothing");
  Require(info.focal_35mm.value_or(1) > 0 && std::isfinite(info.focal_35mm.value_or(1)), "a focal length");
  const Image8 photo = ReadImage8(file);
  Require(photo.width == info.width && photo.height == info.height && photo.channels == 3,
          "the pixels are of another size than the header said");
  static_cast<void>(ReadImageF(file));
}

}  // namespace lumi::fuzz
