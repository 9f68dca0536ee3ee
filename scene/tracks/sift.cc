#include "scene/tracks/sift.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "scene/files/opencv_pixels.h"
#include "scene/program/memory.h"

namespace lumi {
namespace {

// OpenCV's SIFT doubles the photo first and takes a doubled photo's pixel u for u / 2; bilinear doubling puts it at
// u / 2 - 1/4. (cv::SIFT has a switch for this from 4.8 on, off by default.)
constexpr double kSiftShiftPx = -0.25;
// Features nearer than this are one place with two orientations: the first is kept.
constexpr double kSamePlacePx = 0.5;
// SIFT's pyramid finds nothing in a few pixels, and OpenCV's implementation fails on them.
constexpr int kMinSide = 16;
// A picture of more pixels may show enough large spots at half its size, in a quarter of the time.
constexpr double kPixelsWorthHalving = 1e6;

// The picture in grey, scaled, and what is found in it.
struct Search {
  cv::Mat grey;
  Eigen::Vector2d back;  // pixels of the picture a pixel of `grey`
  std::vector<cv::KeyPoint> points;
};

cv::Mat ToGrey(const Image8& image) {
  const cv::Mat view(image.height, image.width, image.channels == 3 ? CV_8UC3 : CV_8UC1,
                     const_cast<std::uint8_t*>(image.data.data()));
  if (image.channels != 3) return view;
  cv::Mat grey;
  cv::cvtColor(view, grey, cv::COLOR_RGB2GRAY);
  return grey;
}

// Ties by place: the order of detection depends on the number of threads.
void Sort(std::vector<cv::KeyPoint>& points, SiftOrder order) {
  const auto key = [order](const cv::KeyPoint& p) {
    const float first = order == SiftOrder::kLargest ? p.size : p.response;
    const float second = order == SiftOrder::kLargest ? p.response : p.size;
    return std::tuple(-first, p.pt.y, p.pt.x, p.angle, -second);
  };
  std::sort(points.begin(), points.end(),
            [&](const cv::KeyPoint& a, const cv::KeyPoint& b) { return key(a) < key(b); });
}

// Which places of the scaled picture are taken, in cells of 4 x 4 pixels; a hash that meets others costs a comparison
// only.
class SpotPlaces {
 public:
  SpotPlaces(int width, int height)
      : cells_across_(width / 4 + 2),
        at_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) / 16 + 1) {}
  bool Take(const cv::Point2f& p) {
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        for (const cv::Point2f& other : at_[Cell(p, dx, dy)])
          if (std::hypot(other.x - p.x, other.y - p.y) < kSamePlacePx) return false;
    at_[Cell(p, 0, 0)].push_back(p);
    return true;
  }

 private:
  std::size_t Cell(const cv::Point2f& p, int dx, int dy) const {
    const int x = static_cast<int>(p.x) / 4 + dx, y = static_cast<int>(p.y) / 4 + dy;
    return static_cast<std::size_t>(static_cast<long>(y + 1) * cells_across_ + x + 1) % at_.size();
  }
  int cells_across_;
  std::vector<std::vector<cv::Point2f>> at_;
};

// Those of `search` that count, in their order, with their places in the picture.
struct Kept {
  std::vector<cv::KeyPoint> points;
  std::vector<SiftFeature> features;
};

Kept Keep(const Search& search, const Image8& image, const Image8& mask, const SiftOptions& o) {
  Kept kept;
  SpotPlaces places(search.grey.cols, search.grey.rows);
  for (const cv::KeyPoint& p : search.points) {
    if (static_cast<int>(kept.points.size()) >= o.max_features) break;
    const Eigen::Vector2d x_px =
        FromOpenCvPixel(Eigen::Vector2d(p.pt.x, p.pt.y).array() + kSiftShiftPx).cwiseProduct(search.back);
    if (!(x_px.x() >= 0 && x_px.y() >= 0 && x_px.x() < image.width && x_px.y() < image.height)) continue;
    if (!mask.empty() && mask.At(static_cast<int>(x_px.x()), static_cast<int>(x_px.y()), 0) == 0) continue;
    if (o.order == SiftOrder::kStrongest && !places.Take(p.pt)) continue;
    kept.points.push_back(p);
    // OpenCV gives the diameter of a disc of one standard deviation around the spot, and degrees.
    kept.features.push_back({x_px, 0.5 * p.size * search.back.mean(), p.angle * CV_PI / 180});
  }
  return kept;
}

// OpenCV doubles the picture, and keeps six blurred pictures and five differences of it, of floats, for each octave.
std::uint64_t PyramidBytes(int width, int height) {
  constexpr double kBytesAPixel = 4 * (6 + 5) * sizeof(float) * 4 / 3.0;
  return static_cast<std::uint64_t>(kBytesAPixel * width * height);
}

}  // namespace

SiftFeatures FindSift(const Image8& image, const Image8& mask, const SiftOptions& o) {
  SiftFeatures found;
  const cv::Mat whole = ToGrey(image);
  const double fit = std::min(1.0, static_cast<double>(o.max_size_px) / std::max(image.width, image.height));
  const auto sift = cv::SIFT::create(0, 3, o.contrast);
  const auto search = [&](double scale) -> std::optional<Search> {
    const int width = static_cast<int>(std::lround(image.width * scale)),
              height = static_cast<int>(std::lround(image.height * scale));
    if (std::min(width, height) < kMinSide) return std::nullopt;
    const MemoryTurn turn(PyramidBytes(width, height));
    Search s{whole, {static_cast<double>(image.width) / width, static_cast<double>(image.height) / height}, {}};
    if (scale < 1) cv::resize(whole, s.grey, cv::Size(width, height), 0, 0, cv::INTER_AREA);
    sift->detect(s.grey, s.points);
    Sort(s.points, o.order);
    return s;
  };
  std::optional<Search> s;
  Kept kept;
  found.scale = fit;
  const double pixels = fit * image.width * fit * image.height;
  if (o.order == SiftOrder::kLargest && pixels > kPixelsWorthHalving && (s = search(fit / 2))) {
    // The smallest spots, which only the photo at its own size shows, would not be kept anyway.
    kept = Keep(*s, image, mask, o);
    if (static_cast<int>(kept.points.size()) < o.max_features) s.reset();
  }
  if (!s) {
    s = search(fit);
    if (!s) return found;
    kept = Keep(*s, image, mask, o);
  }
  found.features = std::move(kept.features);
  if (kept.points.empty()) return found;
  cv::Mat descriptors;
  const std::size_t before = kept.points.size();
  const MemoryTurn turn(PyramidBytes(s->grey.cols, s->grey.rows));
  sift->compute(s->grey, kept.points, descriptors);
  if (kept.points.size() != before) throw std::logic_error("SIFT dropped keypoints of its own");
  found.descriptors.resize(descriptors.rows, kByteDescriptorLength);
  for (int k = 0; k < descriptors.rows; ++k) {
    using Row = Eigen::Matrix<float, 1, kByteDescriptorLength>;
    const Eigen::Map<const Row> d(descriptors.ptr<float>(k));
    const float sum = d.cwiseAbs().sum();
    found.descriptors.row(k) = sum > 0 ? Row((d.cwiseMax(0) / sum).cwiseSqrt()) : Row(d);
  }
  return found;
}

ByteDescriptors ToBytes(const Descriptors& descriptors) {
  constexpr float kUnit = 512;
  return (descriptors.array() * kUnit).round().cwiseMax(0).cwiseMin(255).cast<std::uint8_t>();
}

}  // namespace lumi
