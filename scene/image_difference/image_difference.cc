#include "scene/image_difference/image_difference.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr double kEqualPsnrDb = 99.0;

double PsnrOf(double mse) {
  return mse > 0 ? std::min(kEqualPsnrDb, 10 * std::log10(255.0 * 255.0 / mse)) : kEqualPsnrDb;
}

void RequireSameShape(const Image8& a, const Image8& b) {
  if (a.width != b.width || a.height != b.height || a.channels != 3 || b.channels != 3 || a.empty())
    throw std::invalid_argument("image difference: both must be RGB and of one size");
}

cv::Mat Luma(const Image8& image) {
  cv::Mat luma;
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<std::uint8_t*>(image.data.data()));
  cv::Mat f;
  rgb.convertTo(f, CV_32F);
  cv::cvtColor(f, luma, cv::COLOR_RGB2GRAY);
  return luma;
}

cv::Mat Blur(const cv::Mat& m) {
  cv::Mat out;
  cv::GaussianBlur(m, out, cv::Size(11, 11), 1.5, 1.5, cv::BORDER_REFLECT_101);
  return out;
}

// Mean structural similarity, Wang et al. 2004: K1 = 0.01, K2 = 0.03, range 255; the border of half a window is left
// out, as in the authors' own code.
double Ssim(const Image8& a, const Image8& b) {
  const double c1 = 0.01 * 255 * 0.01 * 255, c2 = 0.03 * 255 * 0.03 * 255;
  const cv::Mat x = Luma(a), y = Luma(b);
  const cv::Mat mx = Blur(x), my = Blur(y);
  const cv::Mat xx = Blur(x.mul(x)), yy = Blur(y.mul(y)), xy = Blur(x.mul(y));
  const int margin = std::min({5, a.width / 2 - 1, a.height / 2 - 1});
  double sum = 0;
  long n = 0;
  for (int j = std::max(0, margin); j < a.height - std::max(0, margin); ++j) {
    const float *px = mx.ptr<float>(j), *py = my.ptr<float>(j), *pxx = xx.ptr<float>(j), *pyy = yy.ptr<float>(j),
                *pxy = xy.ptr<float>(j);
    for (int i = std::max(0, margin); i < a.width - std::max(0, margin); ++i) {
      const double ux = px[i], uy = py[i];
      const double vx = pxx[i] - ux * ux, vy = pyy[i] - uy * uy, cov = pxy[i] - ux * uy;
      sum += (2 * ux * uy + c1) * (2 * cov + c2) / ((ux * ux + uy * uy + c1) * (vx + vy + c2));
      ++n;
    }
  }
  return sum / static_cast<double>(n);
}

}  // namespace

ImageDifference Compare(const Image8& image, const Image8& reference) {
  RequireSameShape(image, reference);
  double squares = 0, absolute = 0;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t *a = image.Row(y), *b = reference.Row(y);
    long row_squares = 0, row_absolute = 0;
    for (int i = 0; i < image.width * 3; ++i) {
      const int d = int(a[i]) - int(b[i]);
      row_squares += d * d;
      row_absolute += std::abs(d);
    }
    squares += static_cast<double>(row_squares);
    absolute += static_cast<double>(row_absolute);
  }
  const double n = static_cast<double>(image.data.size());
  ImageDifference d;
  d.mse = squares / n;
  d.mean_absolute = absolute / n;
  d.psnr_db = PsnrOf(d.mse);
  d.ssim = Ssim(image, reference);
  return d;
}

std::optional<double> PsnrWithin(const Image8& image, const Image8& reference, const Image8& mask) {
  RequireSameShape(image, reference);
  if (mask.width != image.width || mask.height != image.height || mask.channels != 1)
    throw std::invalid_argument("image difference: the mask must have one channel and the pictures' size");
  double squares = 0;
  long n = 0;
  for (std::size_t p = 0; p < mask.data.size(); ++p) {
    if (mask.data[p] <= 127) continue;
    ++n;
    for (std::size_t c = 3 * p; c < 3 * p + 3; ++c) {
      const int d = int(image.data[c]) - int(reference.data[c]);
      squares += d * d;
    }
  }
  if (n == 0) return std::nullopt;
  return PsnrOf(squares / (3.0 * static_cast<double>(n)));
}

Image8 DifferenceImage(const Image8& image, const Image8& reference, double gain) {
  RequireSameShape(image, reference);
  Image8 out(image.width, image.height, 3);
  for (std::size_t i = 0; i < out.data.size(); ++i)
    out.data[i] =
        static_cast<std::uint8_t>(std::min(255.0, gain * std::abs(int(image.data[i]) - int(reference.data[i])) + 0.5));
  return out;
}

}  // namespace lumi
