#include "scene/files/openimageio/color_profile.h"

#include <lcms2.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>

#include "scene/files/open_to_read.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kExifWithin = 1 << 16;  // EXIF is one segment of a JPEG
constexpr int kSrgbCodes = 2;                 // a profile that moves no colour further is sRGB's

struct ProfileCloser {
  void operator()(void* profile) const { cmsCloseProfile(profile); }
};
using Profile = std::unique_ptr<void, ProfileCloser>;

// Thread-safe: made without lcms' cache of the last colour.
class Transform {
 public:
  explicit Transform(const std::string& bytes) {
    const Profile from(cmsOpenProfileFromMem(bytes.data(), static_cast<cmsUInt32Number>(bytes.size())));
    if (!from || cmsGetColorSpace(from.get()) != cmsSigRgbData) return;
    const Profile srgb(cmsCreate_sRGBProfile());
    const auto make = [&](cmsUInt32Number format) {
      return cmsCreateTransform(from.get(), format, srgb.get(), format, INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOCACHE);
    };
    rgb_ = make(TYPE_RGB_8);
    rgba_ = make(TYPE_RGBA_8);
    if (rgb_ && IsIdentity()) Forget();
  }
  ~Transform() { Forget(); }
  Transform(const Transform&) = delete;
  Transform& operator=(const Transform&) = delete;

  void Apply(Image8& image) const {
    cmsHTRANSFORM transform = image.channels == 4 ? rgba_ : image.channels == 3 ? rgb_ : nullptr;
    if (!transform) return;
    for (int y = 0; y < image.height; ++y)
      cmsDoTransform(transform, image.Row(y), image.Row(y), static_cast<cmsUInt32Number>(image.width));
  }

 private:
  bool IsIdentity() const {
    constexpr int kSteps = 9;
    Image8 lattice(kSteps * kSteps, kSteps, 3);
    for (int r = 0; r < kSteps; ++r)
      for (int g = 0; g < kSteps; ++g)
        for (int b = 0; b < kSteps; ++b) {
          const std::array<int, 3> color{r, g, b};
          for (int c = 0; c < 3; ++c)
            lattice.At(g * kSteps + b, r, c) =
                static_cast<std::uint8_t>(color[static_cast<std::size_t>(c)] * 255 / (kSteps - 1));
        }
    Image8 moved = lattice;
    Apply(moved);
    for (std::size_t i = 0; i < moved.data.size(); ++i)
      if (std::abs(moved.data[i] - lattice.data[i]) > kSrgbCodes) return false;
    return true;
  }
  void Forget() {
    for (cmsHTRANSFORM* transform : {&rgb_, &rgba_}) {
      if (*transform) cmsDeleteTransform(*transform);
      *transform = nullptr;
    }
  }

  cmsHTRANSFORM rgb_ = nullptr, rgba_ = nullptr;
};

// The photos of a capture share a profile.
const Transform& TransformFor(const std::string& profile) {
  static std::mutex mutex;
  static std::map<std::string, std::unique_ptr<Transform>> made;
  const std::lock_guard lock(mutex);
  auto& transform = made[profile];
  if (!transform) transform = std::make_unique<Transform>(profile);
  return *transform;
}

// Takes the curve.
std::string RgbProfile(const cmsCIExyYTRIPLE& primaries, cmsToneCurve* curve) {
  const cmsCIExyY white{0.3127, 0.3290, 1};
  const std::array<cmsToneCurve*, 3> curves{curve, curve, curve};
  const Profile profile(cmsCreateRGBProfile(&white, &primaries, curves.data()));
  cmsFreeToneCurve(curve);
  cmsUInt32Number size = 0;
  if (!profile || !cmsSaveProfileToMem(profile.get(), nullptr, &size)) return {};
  std::string bytes(size, '\0');
  return cmsSaveProfileToMem(profile.get(), bytes.data(), &size) ? bytes : std::string();
}

std::string DisplayP3() {
  constexpr std::array<double, 5> kSrgbCurve{2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
  return RgbProfile({{0.680, 0.320, 1}, {0.265, 0.690, 1}, {0.150, 0.060, 1}},
                    cmsBuildParametricToneCurve(nullptr, 4, kSrgbCurve.data()));
}

// Adobe RGB (1998) color image encoding, version 2005-05.
std::string AdobeRgb() {
  return RgbProfile({{0.64, 0.33, 1}, {0.21, 0.71, 1}, {0.15, 0.06, 1}}, cmsBuildGamma(nullptr, 563.0 / 256));
}

// Cameras that are set to Adobe RGB embed no profile: EXIF's colour space is "uncalibrated", and its interoperability
// index is R03 (DCF's optional colour space, CIPA DC-009; EXIF 2.32, section 4.6.7). OpenImageIO does not tell the
// index: its field is looked for in the file's beginning.
bool SaysAdobeRgb(const OIIO::ImageSpec& spec, const fs::path& path) {
  constexpr int kAdobe = 2, kUncalibrated = 65535;  // the first: not in EXIF, written all the same
  const int space = spec.get_int_attribute("Exif:ColorSpace", 0);
  if (space != kUncalibrated) return space == kAdobe;
  using namespace std::string_view_literals;
  std::ifstream file = OpenToRead(path);
  std::string head(kExifWithin, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  return head.find("\x01\0\x02\0\x04\0\0\0R03\0"sv) != std::string::npos ||
         head.find("\0\x01\0\x02\0\0\0\x04R03\0"sv) != std::string::npos;
}

}  // namespace

std::string EmbeddedProfile(const OIIO::ImageSpec& spec, const std::string& format, const fs::path& path) {
  if (format == "raw") return {};  // developed to sRGB
  const OIIO::ParamValue* icc = spec.find_attribute("ICCProfile");
  if (icc && icc->type().basetype == OIIO::TypeDesc::UINT8)
    return {static_cast<const char*>(icc->data()), icc->type().size()};
  return SaysAdobeRgb(spec, path) ? AdobeRgb() : std::string();
}

std::string ProfileOf(const HeifPicture& picture) {
  const std::string profile = picture.Profile();
  return profile.empty() && picture.IsDisplayP3() ? DisplayP3() : profile;
}

void ToSrgb(const std::string& profile, Image8& image) {
  if (!profile.empty()) TransformFor(profile).Apply(image);
}

}  // namespace lumi
