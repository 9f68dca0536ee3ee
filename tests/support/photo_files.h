// Photographs as cameras write them, made byte by byte: TIFF fields (EXIF is made of them), PNG's eXIf chunk, a small
// DNG.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace lumi::test {

inline std::string LittleEndian(std::uint64_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>(value >> (8 * i) & 255);
  return text;
}
inline std::string BigEndian32(std::uint32_t value) {
  const std::string text = LittleEndian(value, 4);
  return {text.rbegin(), text.rend()};
}

struct TiffField {
  int tag = 0, type = 0;
  std::uint32_t count = 0;
  std::string data;
};
inline TiffField Shorts(int tag, const std::vector<int>& values) {
  TiffField f{tag, 3, static_cast<std::uint32_t>(values.size()), {}};
  for (const int v : values) f.data += LittleEndian(static_cast<std::uint64_t>(v), 2);
  return f;
}
inline TiffField Long(int tag, std::uint32_t value) { return {tag, 4, 1, LittleEndian(value, 4)}; }
inline TiffField Bytes(int tag, const std::string& bytes) {
  return {tag, 1, static_cast<std::uint32_t>(bytes.size()), bytes};
}
inline TiffField Ascii(int tag, const std::string& text) {
  return {tag, 2, static_cast<std::uint32_t>(text.size() + 1), text + '\0'};
}
// Signed or not, in units of 1 / 10000.
inline TiffField Rationals(int tag, const std::vector<double>& values, bool is_signed = false) {
  TiffField f{tag, is_signed ? 10 : 5, static_cast<std::uint32_t>(values.size()), {}};
  for (const double v : values)
    f.data += LittleEndian(static_cast<std::uint64_t>(static_cast<std::int64_t>(v * 10000 + (v < 0 ? -0.5 : 0.5))), 4) +
              LittleEndian(10000, 4);
  return f;
}

// A directory at `offset` of its file, and what its fields point to after it.
inline std::string TiffDirectory(const std::vector<TiffField>& fields, std::size_t offset) {
  std::string directory = LittleEndian(fields.size(), 2), data;
  const std::size_t data_at = offset + 2 + 12 * fields.size() + 4;
  for (const TiffField& f : fields) {
    directory += LittleEndian(static_cast<std::uint64_t>(f.tag), 2) +
                 LittleEndian(static_cast<std::uint64_t>(f.type), 2) + LittleEndian(f.count, 4);
    if (f.data.size() <= 4) {
      directory += f.data + std::string(4 - f.data.size(), '\0');
    } else {
      directory += LittleEndian(data_at + data.size(), 4);
      data += f.data + std::string(f.data.size() % 2, '\0');
    }
  }
  return directory + LittleEndian(0, 4) + data;
}

// EXIF as it stands in a file: `main` (camera, orientation), `exif` (lens), `gps`. Tags ascending in each.
inline std::string ExifBlock(std::vector<TiffField> main, const std::vector<TiffField>& exif,
                             const std::vector<TiffField>& gps = {}) {
  constexpr std::size_t kHeader = 8;
  main.push_back(Long(0x8769, 0));
  if (!gps.empty()) main.push_back(Long(0x8825, 0));
  const std::size_t exif_at = kHeader + TiffDirectory(main, kHeader).size(),
                    gps_at = exif_at + TiffDirectory(exif, exif_at).size();
  if (!gps.empty()) main.back() = Long(0x8825, static_cast<std::uint32_t>(gps_at));
  main[main.size() - (gps.empty() ? 1 : 2)] = Long(0x8769, static_cast<std::uint32_t>(exif_at));
  return std::string("II*\0", 4) + LittleEndian(kHeader, 4) + TiffDirectory(main, kHeader) +
         TiffDirectory(exif, exif_at) + (gps.empty() ? "" : TiffDirectory(gps, gps_at));
}

// 48 deg 30' 36" south, 9 deg 15' east, 12.5 m below the sea.
inline std::vector<TiffField> GpsFields() {
  return {Ascii(1, "S"),  Rationals(2, {48, 30, 36}), Ascii(3, "E"), Rationals(4, {9, 15, 0}),
          Bytes(5, "\1"), Rationals(6, {12.5})};
}

inline std::uint32_t PngCrc(const std::string& bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1U ? crc >> 1 ^ 0xEDB88320U : crc >> 1;
  }
  return ~crc;
}

// A chunk eXIf before the pixels of a PNG that is there.
inline void AddExifToPng(const std::filesystem::path& png, const std::string& exif) {
  std::ostringstream all;
  all << std::ifstream(png, std::ios::binary).rdbuf();
  std::string bytes = all.str();
  constexpr std::size_t kAfterHeader = 8 + 25;  // signature, IHDR
  const std::string chunk = "eXIf" + exif;
  bytes.insert(kAfterHeader, BigEndian32(static_cast<std::uint32_t>(exif.size())) + chunk + BigEndian32(PngCrc(chunk)));
  std::ofstream(png, std::ios::binary) << bytes;
}

// A TIFF of one grey strip that says where it was taken.
inline void WriteTiffWithGps(const std::filesystem::path& path) {
  const std::uint32_t size = 16 * 16;
  const auto fields = [&](std::size_t strip_at, std::size_t gps_at) {
    return std::vector<TiffField>{Long(256, 16),    Long(257, 16),
                                  Shorts(258, {8}), Shorts(259, {1}),
                                  Shorts(262, {1}), Long(273, static_cast<std::uint32_t>(strip_at)),
                                  Shorts(277, {1}), Long(278, 16),
                                  Long(279, size),  Long(0x8825, static_cast<std::uint32_t>(gps_at))};
  };
  const std::size_t gps_at = 8 + TiffDirectory(fields(0, 0), 8).size();
  const std::size_t strip_at = gps_at + TiffDirectory(GpsFields(), gps_at).size();
  std::ofstream(path, std::ios::binary) << std::string("II*\0\x08\0\0\0", 8)
                                        << TiffDirectory(fields(strip_at, gps_at), 8)
                                        << TiffDirectory(GpsFields(), gps_at) << std::string(size, '\x80');
}

// A RAW photo of one colour: 12 bits behind a Bayer filter, by a camera whose primaries are sRGB's, its white balance
// done. rgb: linear, 0 to 1.
inline void WriteDng(const std::filesystem::path& file, int width, int height, const std::array<double, 3>& rgb,
                     int orientation = 1, double focal_mm = 5, int focal_35mm = 28) {
  constexpr int kWhite = 4095;
  std::string pixels;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      pixels +=
          LittleEndian(static_cast<std::uint64_t>(rgb[static_cast<std::size_t>(x % 2 + y % 2)] * kWhite + 0.5), 2);
  const auto w = static_cast<std::uint32_t>(width), h = static_cast<std::uint32_t>(height);
  const auto fields = [&](std::uint32_t strip_at, std::uint32_t exif_at, std::uint32_t gps_at) {
    return std::vector<TiffField>{
        Long(254, 0),
        Long(256, w),
        Long(257, h),
        Shorts(258, {16}),
        Shorts(259, {1}),
        Shorts(262, {32803}),
        Ascii(271, "Lumi"),
        Ascii(272, "Test Camera"),
        Long(273, strip_at),
        Shorts(274, {orientation}),
        Shorts(277, {1}),
        Long(278, h),
        Long(279, static_cast<std::uint32_t>(pixels.size())),
        Shorts(284, {1}),
        Shorts(33421, {2, 2}),
        Bytes(33422, std::string("\0\1\1\2", 4)),
        Long(0x8769, exif_at),
        Long(0x8825, gps_at),
        Bytes(50706, std::string("\1\4\0\0", 4)),
        Ascii(50708, "Lumi Test Camera"),
        Shorts(50714, {0}),
        Shorts(50717, {kWhite}),
        Rationals(50721, {3.2405, -1.5371, -0.4985, -0.9693, 1.8760, 0.0416, 0.0556, -0.2040, 1.0572}, true),
        Rationals(50728, {1, 1, 1}),
        Shorts(50778, {21})};
  };
  const std::vector<TiffField> exif{Rationals(0x920A, {focal_mm}), Shorts(0xA405, {focal_35mm})};
  constexpr std::size_t kHeader = 8;
  const std::size_t exif_at = kHeader + TiffDirectory(fields(0, 0, 0), kHeader).size();
  const std::size_t gps_at = exif_at + TiffDirectory(exif, exif_at).size();
  const std::size_t strip_at = gps_at + TiffDirectory(GpsFields(), gps_at).size();
  const auto directory = fields(static_cast<std::uint32_t>(strip_at), static_cast<std::uint32_t>(exif_at),
                                static_cast<std::uint32_t>(gps_at));
  std::ofstream(file, std::ios::binary) << std::string("II*\0", 4) << LittleEndian(kHeader, 4)
                                        << TiffDirectory(directory, kHeader) << TiffDirectory(exif, exif_at)
                                        << TiffDirectory(GpsFields(), gps_at) << pixels;
}

}  // namespace lumi::test
