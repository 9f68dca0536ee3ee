#include "export/plain_jpeg.h"

#include <cstddef>

namespace lumi {
namespace {

// ITU-T T.81, table B.1.
constexpr unsigned kStart = 0xD8, kEnd = 0xD9, kScan = 0xDA, kFirstRestart = 0xD0, kLastRestart = 0xD7, kAlone = 0x01;
constexpr unsigned kJfif = 0xE0, kAdobe = 0xEE, kFirstApp = 0xE0, kLastApp = 0xEF, kComment = 0xFE;

// The part of a segment (marker and length included) that is kept. Adobe's segment says how colours are coded. JFIF's
// may hold a thumbnail after its first 14 bytes, the last two of which are the thumbnail's size.
std::string Left(unsigned marker, std::string segment) {
  constexpr std::size_t kJfifBytes = 4 + 14;
  if (marker == kJfif) {
    if (segment.size() < kJfifBytes || segment.compare(4, 5, std::string("JFIF\0", 5)) != 0) return {};
    segment.resize(kJfifBytes);
    segment[2] = 0;
    segment[3] = static_cast<char>(kJfifBytes - 2);
    segment[kJfifBytes - 2] = segment[kJfifBytes - 1] = 0;
    return segment;
  }
  return marker == kAdobe || (marker != kComment && (marker < kFirstApp || marker > kLastApp)) ? segment
                                                                                               : std::string();
}

// Markers without a length field, which occur only inside a scan or not at all.
bool IsAlone(unsigned marker) {
  return marker == 0 || marker == kAlone || marker == kStart || (marker >= kFirstRestart && marker <= kLastRestart);
}

}  // namespace

std::optional<std::string> PlainJpeg(const std::string& file) {
  const auto byte = [&](std::size_t at) { return static_cast<unsigned>(static_cast<unsigned char>(file[at])); };
  const std::size_t size = file.size();
  if (size < 4 || byte(0) != 0xFF || byte(1) != kStart) return std::nullopt;
  std::string plain = file.substr(0, 2);
  bool scanned = false;
  for (std::size_t at = 2; at + 1 < size;) {
    if (byte(at) != 0xFF) return std::nullopt;
    const unsigned marker = byte(at + 1);
    if (marker == 0xFF) {  // fill
      ++at;
      continue;
    }
    if (marker == kEnd) {
      if (!scanned) return std::nullopt;
      return plain + file.substr(at, 2);
    }
    if (IsAlone(marker) || at + 3 >= size) return std::nullopt;
    const std::size_t length = byte(at + 2) << 8 | byte(at + 3);
    if (length < 2 || at + 2 + length > size) return std::nullopt;
    plain += Left(marker, file.substr(at, 2 + length));
    at += 2 + length;
    if (marker != kScan) continue;
    // Entropy-coded data: ends before the next marker that is not part of it.
    scanned = true;
    const std::size_t begin = at;
    while (at + 1 < size) {
      const unsigned next = byte(at + 1);
      if (byte(at) == 0xFF && next != 0 && next != 0xFF && !(next >= kFirstRestart && next <= kLastRestart)) break;
      ++at;
    }
    plain += file.substr(begin, at - begin);
  }
  return std::nullopt;
}

}  // namespace lumi
