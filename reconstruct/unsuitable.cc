#include "reconstruct/unsuitable.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <map>
#include <vector>

#include "scene/files/image_io.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kFlatViews =
    "cut each into flat views first, as ffmpeg does: -vf v360=e:flat:yaw=0:h_fov=90:v_fov=90, then yaw=45, 90 ...";
constexpr const char* kFisheyeCamera =
    "give its calibration (--camera camera.yaml with distortion_model fisheye), or undistort the photos first";
constexpr std::size_t kLookedAt = 3;  // of photos of one shape, spread: all must look the same

std::string LowerCase(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool IsTwiceAsWide(int width, int height) { return std::abs(width - 2 * height) * 100 <= width; }

// --- what their files say ----------------------------------------------------------------------------------------

std::optional<MissingPhoto> ByMetadata(const InputPhoto& photo, bool fisheye_is_known) {
  constexpr std::array kAllAround{"theta",   "insta360", "gopro max", "gear 360",       "sm-r210",
                                  "sm-c200", "qoocam",   "virb 360",  "keymission 360", "madventure 360"};
  const std::string camera = LowerCase(photo.camera), lens = LowerCase(photo.lens);
  if (LowerCase(photo.projection) == "equirectangular")
    return MissingPhoto{photo.name, "a 360-degree photo: its file says equirectangular", kFlatViews};
  if (photo.panorama)
    return MissingPhoto{photo.name, "a panorama, stitched by the camera from several directions",
                        "take single photos, from several places"};
  if (IsTwiceAsWide(photo.width_px, photo.height_px) &&
      std::ranges::any_of(kAllAround, [&](const char* name) { return camera.find(name) != std::string::npos; }))
    return MissingPhoto{photo.name, fmt::format("a 360-degree photo: twice as wide as high, by {}", photo.camera),
                        kFlatViews};
  if (!fisheye_is_known && (lens.find("fisheye") != std::string::npos || lens.find("fish-eye") != std::string::npos))
    return MissingPhoto{photo.name, fmt::format("a fisheye's photo, by its lens: {}", photo.lens), kFisheyeCamera};
  return std::nullopt;
}

// --- what their pixels show --------------------------------------------------------------------------------------

double Brightness(const Image8& image, int x, int y) {
  return (image.At(x, y, 0) + 2.0 * image.At(x, y, 1) + image.At(x, y, 2)) / 4;
}

double HowAlike(const std::vector<double>& a, const std::vector<double>& b) {
  double aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < a.size(); ++i) aa += a[i] * a[i], bb += b[i] * b[i], ab += a[i] * b[i];
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

// Steps from row to row down a column, away from the poles: detail, not the sky's and the ground's brightness.
std::vector<double> Detail(const Image8& image, int x) {
  std::vector<double> steps;
  for (int y = image.height / 8; y < image.height * 7 / 8; ++y)
    steps.push_back(Brightness(image, x, y + 1) - Brightness(image, x, y));
  return steps;
}

double RowSpread(const Image8& image, int y) {
  double sum = 0, squares = 0;
  for (int x = 0; x < image.width; ++x) {
    const double v = Brightness(image, x, y);
    sum += v;
    squares += v * v;
  }
  const double n = image.width;
  return std::sqrt(std::max(0.0, squares / n - sum / n * sum / n));
}

// Photos of one size, some of them, spread.
std::vector<Image8> SomeOf(const Capture& capture, const std::vector<std::size_t>& photos) {
  std::vector<Image8> pictures;
  const std::size_t n = std::min(kLookedAt, photos.size());
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t at = n > 1 ? i * (photos.size() - 1) / (n - 1) : 0;
    try {
      pictures.push_back(ReadImage8(capture.folder / capture.photos[photos[at]].name));
    } catch (const InputError&) {  // damaged inside: who uses it says so
      return {};
    }
  }
  return pictures;
}

bool AllLookEquirectangular(const std::vector<Image8>& pictures) {
  return !pictures.empty() && std::ranges::all_of(pictures, LooksEquirectangular);
}

// One circle in all of them: a lens, not a plate on black cloth.
bool ShareAnImageCircle(const std::vector<Image8>& pictures) {
  constexpr double kSame = 0.02;
  if (pictures.size() < 2) return false;
  std::optional<ImageCircle> first;
  for (const Image8& picture : pictures) {
    const auto circle = FindImageCircle(picture);
    if (!circle) return false;
    if (!first) first = circle;
    if (std::abs(circle->radius - first->radius) > kSame || std::abs(circle->x - first->x) > kSame ||
        std::abs(circle->y - first->y) > kSame)
      return false;
  }
  return true;
}

}  // namespace

bool LooksEquirectangular(const Image8& photo) {
  constexpr int kHeight = 256, kWidth = 2 * kHeight;
  constexpr double kLeastDetail = 2, kMostPoleSpread = 10, kLeastSpread = 12;  // code values, rms
  constexpr double kGoesOn = 0.7, kLeastAlike = 0.5, kMostAlike = 0.4;  // correlations; the first: of neighbours'
  if (!IsTwiceAsWide(photo.width, photo.height) || photo.height < 64) return false;
  const Image8 small = Resize(photo, kWidth, kHeight);
  if (RowSpread(small, 0) > kMostPoleSpread || RowSpread(small, kHeight - 1) > kMostPoleSpread ||
      RowSpread(small, kHeight / 2) < kLeastSpread)
    return false;
  const std::vector<double> left = Detail(small, 0), right = Detail(small, kWidth - 1);
  double energy = 0;
  for (const double step : left) energy += step * step;
  if (std::sqrt(energy / static_cast<double>(left.size())) < kLeastDetail) return false;
  std::vector<double> neighbours, apart;
  constexpr int kPlaces = 16;
  for (int i = 0; i < kPlaces; ++i) {
    const int x = (2 * i + 1) * kWidth / (2 * kPlaces);
    neighbours.push_back(HowAlike(Detail(small, x), Detail(small, x + 1)));
    apart.push_back(std::abs(HowAlike(left, Detail(small, x))));
  }
  const double around = HowAlike(left, right);
  return around >= std::max(kLeastAlike, kGoesOn * Median(neighbours)) && Median(apart) <= kMostAlike;
}

std::optional<ImageCircle> FindImageCircle(const Image8& photo) {
  constexpr int kShortSide = 160, kBlack = 14, kSectors = 24;
  constexpr double kLeastRadius = 0.35, kMostRadius = 0.65, kMostOffCentre = 0.06;  // of the shorter side
  constexpr double kOutside = 1.05, kRimFrom = 0.88, kRimTo = 0.96;                 // of the radius
  if (photo.empty() || photo.width < kShortSide || photo.height < kShortSide) return std::nullopt;
  const double shrink = static_cast<double>(kShortSide) / std::min(photo.width, photo.height);
  const Image8 small = Resize(photo, static_cast<int>(std::lround(photo.width * shrink)),
                              static_cast<int>(std::lround(photo.height * shrink)));
  const auto lit = [&](int x, int y) {
    return std::max({small.At(x, y, 0), small.At(x, y, 1), small.At(x, y, 2)}) > kBlack;
  };
  int x0 = small.width, x1 = -1, y0 = small.height, y1 = -1;
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x)
      if (lit(x, y)) x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  const bool wide = small.width >= small.height;
  // The shorter side may cut the disc; the longer one shows its diameter.
  const double radius = 0.5 * (wide ? x1 - x0 + 1 : y1 - y0 + 1), cx = 0.5 * (x0 + x1 + 1), cy = 0.5 * (y0 + y1 + 1);
  if (radius < kLeastRadius * kShortSide || radius > kMostRadius * kShortSide ||
      std::abs(cx - 0.5 * small.width) > kMostOffCentre * kShortSide ||
      std::abs(cy - 0.5 * small.height) > kMostOffCentre * kShortSide)
    return std::nullopt;
  std::array<int, kSectors> rim{}, rim_lit{};
  int outside = 0, outside_lit = 0;
  for (int y = 0; y < small.height; ++y)
    for (int x = 0; x < small.width; ++x) {
      const double dx = x + 0.5 - cx, dy = y + 0.5 - cy, r = std::hypot(dx, dy) / radius;
      if (r > kOutside) ++outside, outside_lit += lit(x, y);
      if (r < kRimFrom || r > kRimTo) continue;
      const auto sector = static_cast<std::size_t>((std::atan2(dy, dx) / (2 * M_PI) + 0.5) * kSectors) % kSectors;
      ++rim[sector];
      rim_lit[sector] += lit(x, y);
    }
  constexpr double kLeastOutside = 0.05, kMostLitOutside = 0.005, kLeastLitRim = 0.6;
  if (outside < kLeastOutside * small.width * small.height || outside_lit > kMostLitOutside * outside)
    return std::nullopt;
  for (std::size_t s = 0; s < kSectors; ++s)
    if (rim_lit[s] < kLeastLitRim * rim[s]) return std::nullopt;
  return ImageCircle{cx / kShortSide, cy / kShortSide, radius / kShortSide};
}

void LeaveOutUnsuitable(Capture& capture, const ReconstructOptions& options, ProgressSink& sink) {
  const bool fisheye_is_known = !options.camera_yaml.empty() || !options.poses.empty();
  std::map<std::string, MissingPhoto> refused;
  std::map<std::pair<int, int>, std::vector<std::size_t>> of_size;
  for (std::size_t i = 0; i < capture.photos.size(); ++i) {
    const InputPhoto& photo = capture.photos[i];
    if (const auto why = ByMetadata(photo, fisheye_is_known))
      refused[photo.name] = *why;
    else if (!HasRawExtension(photo.name))  // to develop them only to look at them takes seconds
      of_size[{photo.width_px, photo.height_px}].push_back(i);
  }
  for (const auto& [size, photos] : of_size) {
    const bool twice_as_wide = IsTwiceAsWide(size.first, size.second);
    if (fisheye_is_known && !twice_as_wide) continue;
    const std::vector<Image8> pictures = SomeOf(capture, photos);
    std::optional<MissingPhoto> why;
    if (twice_as_wide && AllLookEquirectangular(pictures))
      why = MissingPhoto{{}, "a 360-degree photo: it goes on from its right edge to its left one", kFlatViews};
    else if (!fisheye_is_known && ShareAnImageCircle(pictures))
      why = MissingPhoto{{}, "a circular fisheye's photo: a disc before black", kFisheyeCamera};
    if (!why) continue;
    for (const std::size_t i : photos) {
      why->name = capture.photos[i].name;
      refused[why->name] = *why;
    }
  }
  if (refused.empty()) return;
  std::erase_if(capture.photos, [&](const InputPhoto& photo) { return refused.contains(photo.name); });
  std::map<std::string, int> reasons;
  for (const auto& [name, why] : refused) {
    capture.unreadable.push_back(why);
    if (reasons[why.reason]++ == 0) sink.Message(fmt::format("left out {}: {} ({})", name, why.reason, why.hint));
  }
  for (const auto& [reason, count] : reasons)
    if (count > 1) sink.Message(fmt::format("left out {} more as the one before: {}", count - 1, reason));
}

}  // namespace lumi
