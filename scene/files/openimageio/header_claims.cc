#include "scene/files/openimageio/header_claims.h"

#include <array>
#include <cstdint>
#include <string_view>

#include "scene/files/open_to_read.h"

namespace lumi {
namespace {

std::uint32_t LittleEndian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (std::size_t k = bytes.size(); k-- > 0;) value = value << 8 | static_cast<unsigned char>(bytes[k]);
  return value;
}

// The length of a text that ends with a zero byte; beyond what a name may have: nothing.
std::optional<std::size_t> TextLength(std::istream& in) {
  constexpr std::size_t kLongestName = 255;
  for (std::size_t n = 0; n <= kLongestName; ++n) {
    const int c = in.get();
    if (c == std::istream::traits_type::eof()) return std::nullopt;
    if (c == 0) return n;
  }
  return std::nullopt;
}

}  // namespace

std::optional<ClaimedSize> WebpSize(const std::filesystem::path& path) {
  std::array<char, 30> head{};
  if (std::ifstream in = OpenToRead(path); !in.read(head.data(), head.size())) return std::nullopt;
  const std::string_view text(head.data(), head.size());
  if (!text.starts_with("RIFF") || text.substr(8, 4) != "WEBP") return std::nullopt;
  const std::string_view chunk = text.substr(12, 4), data = text.substr(20);
  const auto number = [&](std::size_t at, std::size_t bytes) { return LittleEndian(data.substr(at, bytes)); };
  const auto size = [](std::uint32_t width, std::uint32_t height) {
    return ClaimedSize{static_cast<int>(width), static_cast<int>(height)};
  };
  constexpr std::uint32_t k14Bits = (1u << 14) - 1;
  if (chunk == "VP8 ") return size(number(6, 2) & k14Bits, number(8, 2) & k14Bits);
  if (chunk == "VP8L") return size((number(1, 4) & k14Bits) + 1, (number(1, 4) >> 14 & k14Bits) + 1);
  if (chunk == "VP8X") return size(number(4, 3) + 1, number(7, 3) + 1);
  return std::nullopt;
}

bool ExrAttributeBeyondFile(const std::filesystem::path& path) {
  std::ifstream in = OpenToRead(path);
  std::array<char, 8> head{};
  if (!in.read(head.data(), head.size()) || std::string_view(head.data(), 4) != "\x76\x2f\x31\x01") return false;
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  const bool many_parts = LittleEndian({head.data() + 4, 4}) >> 12 & 1;
  // Name, type, length, value; an empty name ends a header, an empty header those of many parts.
  bool first = true;
  while (!error) {
    const auto name = TextLength(in);
    if (!name) return false;
    if (*name == 0) {
      if (!many_parts || first) return false;
      first = true;
      continue;
    }
    std::array<char, 4> length{};
    if (!TextLength(in) || !in.read(length.data(), length.size())) return false;
    const std::uint32_t value_bytes = LittleEndian({length.data(), length.size()});
    if (value_bytes > bytes) return true;
    if (!in.seekg(value_bytes, std::ios::cur)) return false;
    first = false;
  }
  return false;
}

}  // namespace lumi
