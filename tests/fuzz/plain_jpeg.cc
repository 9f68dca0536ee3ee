// A JPEG on its way into a web page: what is left of it is a JPEG that has nothing more to lose.
#include "export/plain_jpeg.h"
#include "tests/fuzz/fuzz_target.h"

namespace lumi::fuzz {

LUMI_FUZZ_TARGET(plain_jpeg) {
  const std::string file(bytes);
  const auto plain = PlainJpeg(file);
  if (!plain) return;
  Require(plain->size() <= file.size(), "it grew");
  Require(plain->find("Exif") == std::string::npos || file.find("Exif") != std::string::npos, "it says something new");
  Require(PlainJpeg(*plain) == plain, "what was plain is not");
}

}  // namespace lumi::fuzz
