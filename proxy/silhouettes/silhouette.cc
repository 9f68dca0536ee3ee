#include "proxy/silhouettes/silhouette.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <vector>

#include "scene/geometry/median.h"

namespace lumi {
namespace {

constexpr std::uint8_t kObject = 255;
constexpr int kOpaque = 128;
constexpr float kTinyRadiusPx = 2;

cv::Mat AsMat(const Image8& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data.data())};
}

Image8 FromMat(const cv::Mat& mat) {
  Image8 image(mat.cols, mat.rows, 1);
  for (int y = 0; y < mat.rows; ++y) std::copy_n(mat.ptr<std::uint8_t>(y), mat.cols, image.Row(y));
  return image;
}

// Parts that hold no circle of this radius; the best of them stays where there is no other.
void RemoveThinParts(cv::Mat& object, double radius) {
  cv::Mat padded, depth, labels;
  cv::copyMakeBorder(object, padded, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  cv::distanceTransform(padded, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  const int count = cv::connectedComponents(object, labels, 8, CV_32S);
  std::vector<float> deepest(static_cast<std::size_t>(count), 0);
  for (int y = 0; y < object.rows; ++y) {
    for (int x = 0; x < object.cols; ++x) {
      if (object.at<std::uint8_t>(y, x) == 0) continue;
      float& d = deepest[static_cast<std::size_t>(labels.at<int>(y, x))];
      d = std::max(d, depth.at<float>(y + 1, x + 1) - 0.5F);
    }
  }
  const auto least = std::min(static_cast<float>(radius), *std::ranges::max_element(deepest));
  for (int y = 0; y < object.rows; ++y) {
    for (int x = 0; x < object.cols; ++x)
      if (deepest[static_cast<std::size_t>(labels.at<int>(y, x))] < least) object.at<std::uint8_t>(y, x) = 0;
  }
}

template <typename IsObject>
Image8 EachPixel(const Image8& image, const IsObject& is_object) {
  Image8 out(image.width, image.height, 1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) out.At(x, y, 0) = is_object(x, y) ? kObject : 0;
  return out;
}

// Widened by a disc of this radius, or narrowed where it is negative.
cv::Mat GrownBy(const cv::Mat& object, double by) {
  cv::Mat distance, result;
  if (by == 0) return object;
  cv::distanceTransform(by > 0 ? cv::Mat(255 - object) : object, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  result = by > 0 ? cv::Mat(distance <= by) : cv::Mat(distance > -by);
  return result;
}

// Parts of `object` smaller than `least` become 0; returns how many parts there were.
int RemoveSmallParts(cv::Mat& object, int least, int connectivity, bool keep_at_border) {
  cv::Mat labels, stats, centroids;
  const int count = cv::connectedComponentsWithStats(object, labels, stats, centroids, connectivity, CV_32S);
  std::vector<bool> remove(static_cast<std::size_t>(count), false);
  for (int n = 1; n < count; ++n) {
    const int x = stats.at<int>(n, cv::CC_STAT_LEFT), y = stats.at<int>(n, cv::CC_STAT_TOP);
    const bool at_border = x == 0 || y == 0 || x + stats.at<int>(n, cv::CC_STAT_WIDTH) == object.cols ||
                           y + stats.at<int>(n, cv::CC_STAT_HEIGHT) == object.rows;
    remove[static_cast<std::size_t>(n)] = stats.at<int>(n, cv::CC_STAT_AREA) < least && !(keep_at_border && at_border);
  }
  for (int y = 0; y < object.rows; ++y) {
    std::uint8_t* row = object.ptr<std::uint8_t>(y);
    const int* label = labels.ptr<int>(y);
    for (int x = 0; x < object.cols; ++x)
      if (remove[static_cast<std::size_t>(label[x])]) row[x] = 0;
  }
  return count - 1;
}

}  // namespace

Image8 SilhouetteFromMask(const Image8& mask) {
  const int colours = mask.channels >= 3 ? 3 : 1;
  return EachPixel(mask, [&](int x, int y) {
    int sum = 0;
    for (int c = 0; c < colours; ++c) sum += mask.At(x, y, c);
    return sum >= kOpaque * colours;
  });
}

Image8 SilhouetteFromAlpha(const Image8& rgba) {
  if (rgba.channels != 4) throw std::invalid_argument("a picture without alpha");
  return EachPixel(rgba, [&](int x, int y) { return rgba.At(x, y, 3) >= kOpaque; });
}

bool HasAlpha(const Image8& rgba) {
  if (rgba.channels != 4) return false;
  for (std::size_t n = 3; n < rgba.data.size(); n += 4)
    if (rgba.data[n] < kOpaque) return true;
  return false;
}

Image8 SilhouetteFromBackground(const Image8& photo, const Image8& background, double threshold) {
  if (photo.width != background.width || photo.height != background.height || photo.channels < 3 ||
      background.channels < 3)
    throw std::invalid_argument("a background of another size");
  return EachPixel(photo, [&](int x, int y) {
    double squared = 0;
    for (int c = 0; c < 3; ++c) {
      const double d = static_cast<double>(photo.At(x, y, c)) - background.At(x, y, c);
      squared += d * d;
    }
    return squared > threshold * threshold;
  });
}

Image8 SilhouetteFromBackground(const Image8& photo, const std::array<double, 3>& rgb, double threshold) {
  if (photo.channels < 3) throw std::invalid_argument("a photo without colours");
  return EachPixel(photo, [&](int x, int y) {
    double squared = 0;
    for (int c = 0; c < 3; ++c) {
      const double d = photo.At(x, y, c) - rgb[static_cast<std::size_t>(c)];
      squared += d * d;
    }
    return squared > threshold * threshold;
  });
}

std::array<double, 3> BorderColour(const Image8& photo) {
  std::array<double, 3> colour{};
  for (int c = 0; c < 3; ++c) {
    std::vector<std::uint8_t> values;
    for (int x = 0; x < photo.width; ++x) {
      values.push_back(photo.At(x, 0, c));
      values.push_back(photo.At(x, photo.height - 1, c));
    }
    for (int y = 0; y < photo.height; ++y) {
      values.push_back(photo.At(0, y, c));
      values.push_back(photo.At(photo.width - 1, y, c));
    }
    colour[static_cast<std::size_t>(c)] = Median(std::move(values));
  }
  return colour;
}

std::string Validate(const CleanOptions& o) {
  if (!(o.close_px >= 0) || !(o.close_px <= 100)) return "the gap to close must be between 0 and 100 pixels";
  if (!(o.grow_px >= -100) || !(o.grow_px <= 100)) return "the growth must be between -100 and 100 pixels";
  if (!(o.min_radius_px >= 0) || !(o.min_radius_px <= 100))
    return "the least radius of a part must be between 0 and 100 pixels";
  if (o.min_part_px < 0 || o.min_hole_px < 0) return "sizes of parts and holes are not negative";
  return {};
}

Image8 Clean(const Image8& silhouette, const CleanOptions& options) {
  // With room around: closing must not see the image's sides as background, nor as object.
  const int margin = static_cast<int>(std::ceil(2 * options.close_px + std::abs(options.grow_px))) + 2;
  cv::Mat object;
  cv::copyMakeBorder(AsMat(silhouette), object, margin, margin, margin, margin, cv::BORDER_REPLICATE);
  if (options.close_px > 0) object = GrownBy(GrownBy(object, options.close_px), -options.close_px);
  cv::Mat inner = object(cv::Rect(margin, margin, silhouette.width, silhouette.height)).clone();
  if (options.min_part_px > 0) RemoveSmallParts(inner, options.min_part_px, 8, false);
  if (options.min_radius_px > 0) RemoveThinParts(inner, options.min_radius_px);
  if (options.min_hole_px > 0) {
    cv::Mat background = 255 - inner;
    RemoveSmallParts(background, options.min_hole_px, 4, true);
    inner = 255 - background;
  }
  if (options.grow_px != 0) {
    cv::copyMakeBorder(inner, object, margin, margin, margin, margin, cv::BORDER_REPLICATE);
    inner = GrownBy(object, options.grow_px)(cv::Rect(margin, margin, silhouette.width, silhouette.height)).clone();
  }
  return FromMat(inner);
}

SilhouetteInfo Describe(const Image8& silhouette) {
  SilhouetteInfo info;
  info.pixels =
      static_cast<std::size_t>(std::ranges::count_if(silhouette.data, [](std::uint8_t m) { return m >= 128; }));
  if (info.pixels == 0) {
    info.kind = SilhouetteKind::kEmpty;
    return info;
  }
  cv::Mat object = AsMat(silhouette) >= 128, labels, depth;
  info.parts = cv::connectedComponents(object, labels, 8, CV_32S) - 1;
  cv::Mat background;
  cv::copyMakeBorder(255 - object, background, 1, 1, 1, 1, cv::BORDER_CONSTANT, 255);
  info.holes = cv::connectedComponents(background, labels, 4, CV_32S) - 2;
  for (int x = 0; x < silhouette.width; ++x)
    info.touches_border |= object.at<std::uint8_t>(0, x) != 0 || object.at<std::uint8_t>(object.rows - 1, x) != 0;
  for (int y = 0; y < silhouette.height; ++y)
    info.touches_border |= object.at<std::uint8_t>(y, 0) != 0 || object.at<std::uint8_t>(y, object.cols - 1) != 0;
  if (info.pixels == silhouette.data.size()) {
    info.kind = SilhouetteKind::kFull;
    return info;
  }
  cv::distanceTransform(object, depth, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  double deepest = 0;
  cv::minMaxLoc(depth, nullptr, &deepest);
  if (deepest - 0.5 < kTinyRadiusPx) info.kind = SilhouetteKind::kTiny;
  return info;
}

std::string Name(SilhouetteKind kind) {
  switch (kind) {
    case SilhouetteKind::kEmpty: return "empty";
    case SilhouetteKind::kFull: return "full";
    case SilhouetteKind::kTiny: return "tiny";
    default: return "normal";
  }
}

}  // namespace lumi
