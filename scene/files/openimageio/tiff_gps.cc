#include "scene/files/openimageio/tiff_gps.h"

#include <array>
#include <cmath>
#include <string_view>

#include "scene/files/open_to_read.h"

namespace lumi {
namespace {

constexpr std::uint32_t kMostFields = 4096;  // of a directory: more is a damaged file
enum Type : std::uint32_t { kByte = 1, kAscii = 2, kLong = 4, kRational = 5 };
enum Tag : std::uint32_t {
  kLatitudeRef = 1,
  kLatitude = 2,
  kLongitudeRef = 3,
  kLongitude = 4,
  kAltitudeRef = 5,
  kAltitude = 6,
  kGpsDirectory = 34853
};

class Tiff {
 public:
  explicit Tiff(const std::filesystem::path& path) : in_(OpenToRead(path)) {
    std::array<char, 4> head{};
    if (!in_.read(head.data(), head.size())) return;
    const std::string_view text(head.data(), head.size());
    little_ = text == std::string_view("II*\0", 4);
    is_tiff_ = little_ || text == std::string_view("MM\0*", 4);
  }
  bool is_tiff() const { return is_tiff_; }

  // An unsigned number of 1, 2 or 4 bytes.
  std::optional<std::uint32_t> Number(std::uint64_t at, std::size_t bytes) {
    std::array<unsigned char, 4> data{};
    in_.clear();
    if (!in_.seekg(static_cast<std::streamoff>(at)) ||
        !in_.read(reinterpret_cast<char*>(data.data()), static_cast<std::streamsize>(bytes)))
      return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | data[little_ ? bytes - 1 - i : i];
    return value;
  }

  // Where a field's values stand; nothing where the directory has none of this type and at least this count.
  std::optional<std::uint64_t> Field(std::uint64_t directory, Tag tag, Type type, std::uint32_t count) {
    const auto fields = Number(directory, 2);
    if (!fields || *fields > kMostFields) return std::nullopt;
    for (std::uint32_t i = 0; i < *fields; ++i) {
      const std::uint64_t at = directory + 2 + 12ull * i;
      if (Number(at, 2) != tag) continue;
      const auto values = Number(at + 4, 4);
      if (Number(at + 2, 2) != type || !values || *values < count) return std::nullopt;
      const std::uint64_t bytes = (type == kRational ? 8ull : type == kLong ? 4ull : 1ull) * *values;
      if (bytes <= 4) return at + 8;
      return Number(at + 8, 4);
    }
    return std::nullopt;
  }

  std::optional<double> Rational(std::uint64_t at) {
    const auto above = Number(at, 4), below = Number(at + 4, 4);
    if (!above || !below || *below == 0) return std::nullopt;
    return static_cast<double>(*above) / *below;
  }

  // Degrees, minutes, seconds, and the side that counts as negative.
  std::optional<double> Degrees(std::uint64_t directory, Tag tag, Tag side, char negative) {
    const auto at = Field(directory, tag, kRational, 3);
    if (!at) return std::nullopt;
    double degrees = 0, unit = 1;
    for (std::uint64_t i = 0; i < 3; ++i, unit /= 60) {
      const auto part = Rational(*at + 8 * i);
      if (!part) return std::nullopt;
      degrees += *part * unit;
    }
    const auto side_at = Field(directory, side, kAscii, 1);
    return side_at && Number(*side_at, 1) == static_cast<unsigned char>(negative) ? -degrees : degrees;
  }

 private:
  std::ifstream in_;
  bool little_ = false, is_tiff_ = false;
};

}  // namespace

std::optional<GpsPosition> TiffGps(const std::filesystem::path& path) {
  Tiff tiff(path);
  if (!tiff.is_tiff()) return std::nullopt;
  const auto first = tiff.Number(4, 4);
  const auto gps_at = first ? tiff.Field(*first, kGpsDirectory, kLong, 1) : std::nullopt;
  const auto gps = gps_at ? tiff.Number(*gps_at, 4) : std::nullopt;
  if (!gps) return std::nullopt;
  const auto latitude = tiff.Degrees(*gps, kLatitude, kLatitudeRef, 'S'),
             longitude = tiff.Degrees(*gps, kLongitude, kLongitudeRef, 'W');
  if (!latitude || !longitude || std::abs(*latitude) > 90 || std::abs(*longitude) > 180) return std::nullopt;
  GpsPosition position{*latitude, *longitude, {}};
  if (const auto at = tiff.Field(*gps, kAltitude, kRational, 1))
    if (const auto altitude = tiff.Rational(*at)) {
      const auto below = tiff.Field(*gps, kAltitudeRef, kByte, 1);
      position.altitude_m = below && tiff.Number(*below, 1) == 1u ? -*altitude : *altitude;
    }
  return position;
}

}  // namespace lumi
