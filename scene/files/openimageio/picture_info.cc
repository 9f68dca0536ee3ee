#include "scene/files/openimageio/picture_info.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "scene/files/open_to_read.h"
#include "scene/files/openimageio/tiff_gps.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr double kFilmWidthMm = 35;  // COLMAP's rule: focal length in px = its film equivalent / 35 * longer side
// Plausible sensor sizes; outside of them the stated resolution is not the sensor's (it is the print's, or means
// nothing).
constexpr double kLeastSensorMm = 2, kMostSensorMm = 100;
constexpr std::size_t kXmpWithin = 1 << 18;  // bytes from a file's beginning

// An attribute as a number, whether the container's reader keeps it as an int or a float: get_float gives 0 for an int
// of TIFF's reader.
double Number(const OIIO::ImageSpec& spec, const char* name, double otherwise) {
  const OIIO::ParamValue* value = spec.find_attribute(name);
  if (!value) return otherwise;
  const auto number = static_cast<double>(value->get_float(0));
  return number != 0 ? number : static_cast<double>(value->get_int(0));
}

std::optional<double> Positive(const OIIO::ImageSpec& spec, const char* name) {
  const double value = Number(spec, name, 0);
  return value > 0 && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::string Text(const OIIO::ImageSpec& spec, const char* name) {
  std::string text(spec.get_string_attribute(name));
  while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.pop_back();
  return text;
}

// The sensor's longer side by its resolution, where EXIF has that.
std::optional<double> SensorMm(const OIIO::ImageSpec& spec) {
  const auto per_unit = Positive(spec, "Exif:FocalPlaneXResolution");
  if (!per_unit) return std::nullopt;
  double unit_mm = 25.4;
  switch (spec.get_int_attribute("Exif:FocalPlaneResolutionUnit", 2)) {
    case 3: unit_mm = 10; break;
    case 4: unit_mm = 1; break;
    case 5: unit_mm = 0.001; break;
    default: break;
  }
  const int wide = spec.get_int_attribute("Exif:PixelXDimension", spec.width),
            high = spec.get_int_attribute("Exif:PixelYDimension", spec.height);
  const double sensor_mm = std::max(wide, high) / *per_unit * unit_mm;
  return sensor_mm >= kLeastSensorMm && sensor_mm <= kMostSensorMm ? std::optional(sensor_mm) : std::nullopt;
}

std::optional<double> Degrees(const OIIO::ImageSpec& spec, const char* name, const char* reference, char negative) {
  const OIIO::ParamValue* value = spec.find_attribute(name);
  if (!value || value->type().numelements() * value->type().aggregate < 3) return std::nullopt;
  const double degrees =
      value->get_float_indexed(0) + value->get_float_indexed(1) / 60.0 + value->get_float_indexed(2) / 3600.0;
  if (!std::isfinite(degrees)) return std::nullopt;
  const std::string side = Text(spec, reference);
  return !side.empty() && side.front() == negative ? -degrees : degrees;
}

std::optional<GpsPosition> Gps(const OIIO::ImageSpec& spec) {
  const auto latitude = Degrees(spec, "GPS:Latitude", "GPS:LatitudeRef", 'S'),
             longitude = Degrees(spec, "GPS:Longitude", "GPS:LongitudeRef", 'W');
  if (!latitude || !longitude || std::abs(*latitude) > 90 || std::abs(*longitude) > 180) return std::nullopt;
  GpsPosition gps{*latitude, *longitude, {}};
  if (const double altitude = Number(spec, "GPS:Altitude", NAN); std::isfinite(altitude))
    gps.altitude_m = spec.get_int_attribute("GPS:AltitudeRef", 0) == 1 ? -altitude : altitude;
  return gps;
}

// XMP is text, wherever the container keeps it; its tag is searched as such.
std::string Projection(const fs::path& path) {
  std::ifstream file = OpenToRead(path);
  std::string head(kXmpWithin, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, file.gcount())));
  constexpr std::string_view kTag = "GPano:ProjectionType";
  const std::size_t tag = head.find(kTag);
  if (tag == std::string::npos) return {};
  // GPano:ProjectionType="equirectangular", or <GPano:ProjectionType>equirectangular<
  const std::size_t begin = head.find_first_of("\"'>", tag + kTag.size());
  if (begin == std::string::npos || begin > tag + kTag.size() + 4) return {};
  const std::size_t end = head.find_first_of("\"'<", begin + 1);
  return end == std::string::npos || end - begin > 40 ? std::string() : head.substr(begin + 1, end - begin - 1);
}

}  // namespace

ImageInfo PictureInfo(const OIIO::ImageSpec& spec, const std::string& format, const fs::path& path) {
  ImageInfo info;
  info.width = spec.width;
  info.height = spec.height;
  info.channels = spec.nchannels;
  info.orientation = std::clamp(spec.get_int_attribute("Orientation", 1), 1, 8);
  // Their decoders have turned the pixels by the container's word (HEIF's irot and imir, RAW's flip); what EXIF repeats
  // of it must not count twice.
  if (format == "heif" || format == "raw") info.orientation = 1;
  info.focal_mm = Positive(spec, "Exif:FocalLength");
  info.focal_35mm = Positive(spec, "Exif:FocalLengthIn35mmFilm");
  if (const auto sensor_mm = SensorMm(spec); sensor_mm && info.focal_mm && !info.focal_35mm)
    info.focal_35mm = *info.focal_mm / *sensor_mm * kFilmWidthMm;
  for (const char* name : {"Exif:DateTimeOriginal", "DateTime"})
    if (const std::string time = Text(spec, name); !time.empty() && !info.capture_time) info.capture_time = time;
  info.gps = TiffGps(path);
  if (!info.gps) info.gps = Gps(spec);
  info.make = Text(spec, "Make");
  info.model = Text(spec, "Model");
  info.lens = Text(spec, "Exif:LensModel");
  constexpr int kStitched = 6;  // CustomRendered: panorama, as phones write it
  info.panorama = spec.get_int_attribute("Exif:CustomRendered", 0) == kStitched;
  info.projection = Projection(path);
  return info;
}

}  // namespace lumi
