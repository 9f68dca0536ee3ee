#include "timeperiodic/moving_parts.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "scene/program/parallel.h"
#include "timeperiodic/least_squares.h"

namespace lumi {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kPartHarmonics = 4;
constexpr double kMinSeen = 0.5;       // of the frames, for a pixel to be judged
constexpr double kField_px = 0.35;     // error of the aligning field: a brightness step moved by this is no motion
constexpr double kPeriodicChance = 4;  // standard deviations above the share that harmonics explain by chance
constexpr double kStrongly = 3;        // times min_deviation: what varies by this moves, whether it repeats or not
constexpr double kSpeck = 0.0008;      // of the picture: smaller spots are noise

cv::Mat Disc(int radius) { return cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * radius + 1, 2 * radius + 1}); }

}  // namespace

MovingParts FindMovingParts(const FrameStack& stack, const Alignment& alignment, std::optional<double> period,
                            const MovingPartsOptions& options) {
  const int w = stack.width, h = stack.height, pixels = w * h;
  const auto n = static_cast<Eigen::Index>(alignment.frames.size());
  const PixelAt pixel = AlignedPixels(stack, alignment);
  const MatrixXd covariates = CameraCovariates(alignment);
  MatrixXd nuisance(n, 1 + covariates.cols());
  nuisance << VectorXd::Ones(n), covariates;
  const MatrixXd Q = OrthonormalSpan(nuisance);
  MatrixXd P(n, 0);
  if (period) {
    MatrixXd B(n, 2 * kPartHarmonics);
    for (Eigen::Index i = 0; i < n; ++i)
      for (int k = 0; k < kPartHarmonics; ++k) {
        const double angle =
            6.283185307179586 * (k + 1) *
            std::fmod(stack.time[static_cast<std::size_t>(alignment.frames[static_cast<std::size_t>(i)])] / *period,
                      1.0);
        B(i, 2 * k) = std::cos(angle);
        B(i, 2 * k + 1) = std::sin(angle);
      }
    P = OrthonormalSpan(B - Q * (Q.transpose() * B));
  }
  cv::Mat mean = cv::Mat::zeros(h, w, CV_32F), rest = cv::Mat::zeros(h, w, CV_32F),
          periodic = cv::Mat::zeros(h, w, CV_32F), seen = cv::Mat::zeros(h, w, CV_32F);
  ParallelFor(static_cast<std::size_t>(pixels), 64, [&](std::size_t begin, std::size_t end) {
    MatrixXd v(n, 3);
    for (std::size_t p = begin; p < end; ++p) {
      Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
      Eigen::Index count = 0;
      for (Eigen::Index i = 0; i < n; ++i) {
        float rgb[3];
        pixel(alignment.frames[static_cast<std::size_t>(i)], static_cast<int>(p), rgb);
        v.row(i) << static_cast<double>(rgb[0]), static_cast<double>(rgb[1]), static_cast<double>(rgb[2]);
        if (rgb[0] >= 0) sum += v.row(i), ++count;
      }
      const int y = static_cast<int>(p) / w, x = static_cast<int>(p) % w;
      seen.at<float>(y, x) = static_cast<float>(count) / static_cast<float>(n);
      if (static_cast<double>(count) < kMinSeen * static_cast<double>(n)) continue;
      const Eigen::RowVector3d m = sum / static_cast<double>(count);
      for (Eigen::Index i = 0; i < n; ++i) {
        if (v(i, 0) < 0)
          v.row(i).setZero();
        else
          v.row(i) -= m;
      }
      const MatrixXd r = v - Q * (Q.transpose() * v);
      const auto frames = static_cast<double>(count);
      mean.at<float>(y, x) = static_cast<float>(m.mean());
      rest.at<float>(y, x) = static_cast<float>(r.squaredNorm() / frames / 3);
      if (P.cols() == 0) continue;
      const double explained = (P.transpose() * r).squaredNorm();
      const auto fitted = static_cast<double>(P.cols());
      const double chance =
          (fitted + kPeriodicChance * std::sqrt(2 * fitted)) / std::max(fitted, frames - static_cast<double>(Q.cols()));
      if (explained > chance * r.squaredNorm()) periodic.at<float>(y, x) = static_cast<float>(explained / frames / 3);
    }
  });
  cv::Mat gx, gy, raw = cv::Mat::zeros(h, w, CV_8U);
  cv::Sobel(mean, gx, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(mean, gy, CV_32F, 0, 1, 3, 0.125);
  for (int y = 0; y < h; ++y)
    for (int x = 0; x < w; ++x) {
      if (static_cast<double>(seen.at<float>(y, x)) < kMinSeen) continue;
      const double slope2 =
          static_cast<double>(gx.at<float>(y, x) * gx.at<float>(y, x) + gy.at<float>(y, x) * gy.at<float>(y, x));
      const double field = 4 * kField_px * kField_px * slope2;
      const double least = options.min_deviation * (period ? kStrongly : 1.0);
      const bool varies = static_cast<double>(rest.at<float>(y, x)) > least * least + (period ? 3 : 1) * field;
      const bool repeats =
          static_cast<double>(periodic.at<float>(y, x)) > options.min_periodic * options.min_periodic + 0.2 * field;
      raw.at<unsigned char>(y, x) = varies || (period && repeats) ? 255 : 0;
    }
  // Specks are noise; holes between what moves move too.
  cv::Mat labels, stats, centres, mask = cv::Mat::zeros(h, w, CV_8U);
  cv::Mat closed;
  cv::morphologyEx(raw, closed, cv::MORPH_CLOSE, Disc(std::max(1, w / 96)));
  const int parts = cv::connectedComponentsWithStats(closed, labels, stats, centres, 8);
  for (int k = 1; k < parts; ++k)
    if (stats.at<int>(k, cv::CC_STAT_AREA) >= std::max(4.0, kSpeck * pixels)) mask.setTo(255, labels == k);
  cv::dilate(mask, mask, Disc(std::max(1, static_cast<int>(std::lround(options.grow * w)))));
  MovingParts result;
  result.mask = Image8(w, h, 1);
  std::copy(mask.datastart, mask.dataend, result.mask.data.begin());
  result.share = static_cast<double>(cv::countNonZero(mask)) / pixels;
  return result;
}

Image8 FrameMask(const FrameStack& stack, const Alignment& alignment, const MovingParts& parts, int frame) {
  // The nearest frame that is aligned.
  const auto after = std::ranges::lower_bound(alignment.frames, frame);
  Eigen::Index row =
      std::min<Eigen::Index>(after - alignment.frames.begin(), static_cast<Eigen::Index>(alignment.frames.size()) - 1);
  if (row > 0 && frame - alignment.frames[static_cast<std::size_t>(row - 1)] <
                     std::abs(alignment.frames[static_cast<std::size_t>(row)] - frame))
    --row;
  const int w = stack.width, h = stack.height;
  cv::Mat small = cv::Mat::zeros(h, w, CV_8U);
  for (int p = 0; p < w * h; ++p) {
    if (parts.mask.data[static_cast<std::size_t>(p)] == 0) continue;
    const Eigen::Vector2f x = alignment.InFrame(row, p);
    const int i = static_cast<int>(std::lround(x.x())), j = static_cast<int>(std::lround(x.y()));
    if (i >= 0 && j >= 0 && i < w && j < h) small.at<unsigned char>(j, i) = 255;
  }
  cv::morphologyEx(small, small, cv::MORPH_CLOSE, Disc(2));
  cv::Mat large;
  cv::resize(small, large, {stack.video_width, stack.video_height}, 0, 0, cv::INTER_LINEAR);
  Image8 mask(stack.video_width, stack.video_height, 1);
  for (int y = 0; y < mask.height; ++y)
    for (int x = 0; x < mask.width; ++x) mask.At(x, y, 0) = large.at<unsigned char>(y, x) > 64 ? 0 : 255;
  return mask;
}

}  // namespace lumi
