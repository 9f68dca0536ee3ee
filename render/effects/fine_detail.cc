#include "render/effects/fine_detail.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "scene/geometry/median.h"

namespace lumi {
namespace {

// In units of step_px: sigma of the smoothing of the fine and of the coarse derivative, and of the window over which
// energies are averaged.
constexpr double kFineSigma = 0.8, kCoarseSigma = 2.4, kWindowSigma = 4;
constexpr double kPixelVariance = 1.0 / 12;        // of a pixel's own square
constexpr double kTooDark = 16, kTooBright = 240;  // code values: noise below, clipping above
constexpr double kLeastNoise = 0.3;                // code values: rounding, averaged over three channels

float Grey(const std::uint8_t* p) { return static_cast<float>(p[0] + p[1] + p[2]) / 3.0F; }

// A Gaussian and its derivative, scaled so that the derivative of a ramp is its slope.
struct Kernels {
  int radius;
  std::vector<float> smooth, slope;
  double noise_gain = 0;  // variance of a gradient component of white noise of variance 1

  explicit Kernels(double sigma) : radius(static_cast<int>(std::ceil(3 * sigma))) {
    double sum = 0, moment = 0;
    for (int i = -radius; i <= radius; ++i) {
      const double g = std::exp(-0.5 * i * i / (sigma * sigma));
      sum += g;
      moment += g * i * i;
      smooth.push_back(static_cast<float>(g));
    }
    double smooth2 = 0, slope2 = 0;
    for (int i = -radius; i <= radius; ++i) {
      float& g = smooth[static_cast<std::size_t>(i + radius)];
      slope.push_back(static_cast<float>(-i * static_cast<double>(g) / moment));
      g = static_cast<float>(static_cast<double>(g) / sum);
      smooth2 += static_cast<double>(g * g);
      slope2 += static_cast<double>(slope.back() * slope.back());
    }
    noise_gain = smooth2 * slope2;
  }
};

// out[i] += factor * values[stride * i]
void AddScaled(float factor, const float* values, std::size_t stride, std::vector<float>& out) {
  if (stride == 1)
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += factor * values[i];
  else
    for (std::size_t i = 0; i < out.size(); ++i) out[i] += factor * values[stride * i];
}

struct Gradients {
  double weaker = 0;  // the smaller eigenvalue of the structure tensor, code values squared per pixel squared
  double noise = 0;   // the value that noise alone has
  double mean = 0;    // code value
};

// Gradients of the photo smoothed by `sigma`, at every `hop`th pixel within 2 `window` of (x, y). nullopt if these
// pixels reach beyond the photo.
std::optional<Gradients> MeasureGradients(const Image8& photo, double x, double y, double sigma, double window, int hop,
                                          double noise_sigma) {
  const Kernels kernels(sigma);
  const int steps = static_cast<int>(std::ceil(2 * window / hop)), reach = hop * steps, border = reach + kernels.radius;
  const int cx = static_cast<int>(std::floor(x)), cy = static_cast<int>(std::floor(y));
  if (cx < border || cy < border || cx + border >= photo.width || cy + border >= photo.height) return std::nullopt;

  const auto side = static_cast<std::size_t>(2 * border + 1), columns = static_cast<std::size_t>(2 * steps + 1),
             h = static_cast<std::size_t>(hop);
  std::vector<float> grey(side * side);
  for (std::size_t j = 0; j < side; ++j) {
    const std::uint8_t* row = photo.Row(cy - border + static_cast<int>(j)) + 3 * (cx - border);
    for (std::size_t i = 0; i < side; ++i) grey[j * side + i] = Grey(row + 3 * i);
  }
  const auto weight = [&](int c, std::size_t i, double at) {
    const double d = c - reach + static_cast<double>(h * i) + 0.5 - at;
    return std::exp(-0.5 * d * d / (window * window));
  };
  std::vector<double> weight_x(columns);
  for (std::size_t i = 0; i < columns; ++i) weight_x[i] = weight(cx, i, x);
  // Down the columns, then along the rows.
  std::vector<float> smooth(side), slope(side), gx(columns), gy(columns);
  double xx = 0, xy = 0, yy = 0, sum = 0, mean = 0;
  for (std::size_t j = 0; j < columns; ++j) {
    for (std::vector<float>* sums : {&smooth, &slope, &gx, &gy}) std::fill(sums->begin(), sums->end(), 0.0F);
    for (std::size_t k = 0; k < kernels.smooth.size(); ++k) {
      AddScaled(kernels.smooth[k], &grey[(h * j + k) * side], 1, smooth);
      AddScaled(kernels.slope[k], &grey[(h * j + k) * side], 1, slope);
    }
    for (std::size_t k = 0; k < kernels.smooth.size(); ++k) {
      AddScaled(kernels.slope[k], &smooth[k], h, gx);
      AddScaled(kernels.smooth[k], &slope[k], h, gy);
    }
    const double weight_y = weight(cy, j, y);
    for (std::size_t i = 0; i < columns; ++i) {
      const double w = weight_x[i] * weight_y, u = static_cast<double>(gx[i]), v = static_cast<double>(gy[i]);
      xx += w * u * u;
      xy += w * u * v;
      yy += w * v * v;
      sum += w;
      mean += w * static_cast<double>(smooth[h * i + static_cast<std::size_t>(kernels.radius)]);
    }
  }
  return Gradients{(0.5 * (xx + yy) - std::hypot(0.5 * (xx - yy), xy)) / sum,
                   kernels.noise_gain * noise_sigma * noise_sigma, mean / sum};
}

}  // namespace

double NoiseSigma(const Image8& photo) {
  constexpr int kBlock = 8, kEvery = 16;
  constexpr double kFlattest = 0.05;  // share of the blocks
  std::vector<double> sigmas;
  for (int top = 1; top + kBlock < photo.height; top += kEvery)
    for (int left = 1; left + kBlock < photo.width; left += kEvery) {
      double square = 0, mean = 0;
      for (int y = top; y < top + kBlock; ++y) {
        const std::uint8_t *above = photo.Row(y - 1), *here = photo.Row(y), *below = photo.Row(y + 1);
        for (int x = 3 * left; x < 3 * (left + kBlock); x += 3) {
          // This filter is 0 for ramps and for straight edges along the axes (Immerkaer, 1996); white noise comes out
          // with 36 times its variance.
          const float d = Grey(above + x - 3) - 2 * Grey(above + x) + Grey(above + x + 3) - 2 * Grey(here + x - 3) +
                          4 * Grey(here + x) - 2 * Grey(here + x + 3) + Grey(below + x - 3) - 2 * Grey(below + x) +
                          Grey(below + x + 3);
          square += static_cast<double>(d * d) / 36;
          mean += static_cast<double>(Grey(here + x));
        }
      }
      mean /= kBlock * kBlock;
      if (mean > kTooDark && mean < kTooBright) sigmas.push_back(std::sqrt(square / (kBlock * kBlock)));
    }
  if (sigmas.empty()) return kLeastNoise;
  const auto place = static_cast<std::size_t>(kFlattest * static_cast<double>(sigmas.size()));
  return std::max(kLeastNoise, NthSmallest(std::move(sigmas), place));
}

std::optional<FineDetail> MeasureFineDetail(const Image8& photo, double x, double y, double step_px,
                                            double noise_sigma) {
  // The same total smoothing as in the photo with the larger pixels, by its pixels and the kernel.
  const auto sigma = [&](double steps) {
    return std::sqrt(step_px * step_px * (steps * steps + kPixelVariance) - kPixelVariance);
  };
  const double window = kWindowSigma * step_px;
  const auto coarse = MeasureGradients(photo, x, y, sigma(kCoarseSigma), window, 3, noise_sigma);
  if (!coarse || coarse->mean < kTooDark || coarse->mean > kTooBright) return std::nullopt;
  const auto fine = MeasureGradients(photo, x, y, sigma(kFineSigma), window, 1, noise_sigma);
  // A part of the noise is kept as a lower bound, because the logarithm of 0 is not finite.
  const auto left = [](const Gradients& g) { return std::max(g.weaker - g.noise, 0.25 * g.noise); };
  return FineDetail{std::log(left(*fine) / left(*coarse)),
                    std::log(left(*fine) * step_px * step_px / (coarse->mean * coarse->mean)),
                    fine->weaker / fine->noise};
}

}  // namespace lumi
