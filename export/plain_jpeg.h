// A JPEG file without what its pixels do not need: where and when it was taken and by whom, thumbnails, films behind
// it. The pixels stay what they are, to the bit.
#pragma once

#include <optional>
#include <string>

namespace lumi {

// Nothing where the bytes are no whole JPEG file.
std::optional<std::string> PlainJpeg(const std::string& file);

}  // namespace lumi
