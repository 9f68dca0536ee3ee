#include "timeperiodic/signals.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/parallel.h"
#include "timeperiodic/least_squares.h"

namespace lumi {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

constexpr double kMinGainSpread = 0.004;  // below: rounding and motion, not exposure
constexpr double kMinSeenShare = 0.9;     // of the frames, of a pixel that is used
constexpr double kDarkGain = 0.25;        // of the median exposure: a frame's noise counts four times as much
constexpr double kMostDark = 0.1;         // of the frames, that are left out as dark
// A brightness step that is misplaced by this leaves a variance of its square: the camera's, not the scene's. Pixels.
constexpr double kMisplaced_px = 0.25;

// All frames' values of one pixel and channel; what is not seen takes the mean of what is.
struct Column {
  VectorXd value;
  double seen = 0, mean = 0;
};

class Columns {
 public:
  Columns(const std::vector<int>& frames, const PixelAt& pixel, const VectorXd& gain)
      : frames_(frames), pixel_(pixel), gain_(gain) {}
  void Get(int p, Column (&column)[3]) const {
    const auto n = static_cast<Eigen::Index>(frames_.size());
    for (Column& c : column) c.value.resize(n), c.seen = c.mean = 0;
    std::vector<char> seen(frames_.size(), 1);
    for (Eigen::Index i = 0; i < n; ++i) {
      float rgb[3];
      pixel_(frames_[static_cast<std::size_t>(i)], p, rgb);
      for (int k = 0; k < 3; ++k) {
        if (rgb[k] < 0) {
          seen[static_cast<std::size_t>(i)] = 0;
          continue;
        }
        column[k].value[i] = static_cast<double>(rgb[k]) / gain_[i];
        column[k].mean += column[k].value[i];
        ++column[k].seen;
      }
    }
    for (Column& c : column) {
      if (c.seen > 0) c.mean /= c.seen;
      for (Eigen::Index i = 0; i < n; ++i)
        if (!seen[static_cast<std::size_t>(i)]) c.value[i] = c.mean;
      c.value.array() -= c.mean;
      c.seen /= static_cast<double>(n);
    }
  }

 private:
  const std::vector<int>& frames_;
  const PixelAt& pixel_;
  const VectorXd& gain_;
};

// A gain a frame: the median over pixels of their ratio to their own mean. Motion is the lesser part of a picture.
VectorXd Gains(int pixels, const std::vector<int>& frames, const PixelAt& pixel) {
  const auto n = static_cast<Eigen::Index>(frames.size());
  const VectorXd ones = VectorXd::Ones(n);
  const Columns columns(frames, pixel, ones);
  const int step = std::max(1, pixels / 1500);
  std::vector<int> at;
  for (int p = step / 2; p < pixels; p += step) at.push_back(p);
  MatrixXf ratio(n, static_cast<Eigen::Index>(at.size()));
  std::vector<char> usable(at.size(), 0);
  ParallelFor(at.size(), 16, [&](std::size_t begin, std::size_t end) {
    Column c[3];
    for (std::size_t j = begin; j < end; ++j) {
      columns.Get(at[j], c);
      const double mean = c[0].mean + c[1].mean + c[2].mean;
      if (mean < 60 || mean > 720 || c[0].seen < 1) continue;
      usable[j] = 1;
      ratio.col(static_cast<Eigen::Index>(j)) =
          (((c[0].value + c[1].value + c[2].value).array() + mean) / mean).cast<float>();
    }
  });
  std::vector<Eigen::Index> used;
  for (std::size_t j = 0; j < at.size(); ++j)
    if (usable[j]) used.push_back(static_cast<Eigen::Index>(j));
  VectorXd gain = ones;
  if (used.size() < 30) return gain;
  ParallelFor(static_cast<std::size_t>(n), 64, [&](std::size_t begin, std::size_t end) {
    std::vector<double> r(used.size());
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t j = 0; j < used.size(); ++j)
        r[j] = static_cast<double>(ratio(static_cast<Eigen::Index>(i), used[j]));
      gain[static_cast<Eigen::Index>(i)] = Quantile(r, 0.5);
    }
  });
  return gain;
}

// Rows of the frames that are not black beside the others (a fade, a shutter): divided by their exposure they would be
// nothing but noise, or nan. All of them where the dark ones are many: those are the scene's own.
std::vector<Eigen::Index> LitFrames(const VectorXd& gain) {
  const double least = kDarkGain * Quantile({gain.begin(), gain.end()}, 0.5);
  std::vector<Eigen::Index> lit, all(static_cast<std::size_t>(gain.size()));
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  for (const Eigen::Index i : all)
    if (gain[i] > least) lit.push_back(i);
  return static_cast<double>(lit.size()) >= (1 - kMostDark) * static_cast<double>(all.size()) ? lit : all;
}

// The strongest directions of A's columns: a random start and two rounds of the power method (Halko et al. 2011).
MatrixXd PrincipalComponents(const MatrixXd& A, int count) {
  const Eigen::Index k = std::min<Eigen::Index>({A.cols(), A.rows(), count + 8});
  MatrixXd V(A.cols(), k);
  std::uint32_t state = 12345;
  for (Eigen::Index i = 0; i < V.size(); ++i) {
    state = state * 1664525U + 1013904223U;
    V.data()[i] = static_cast<double>(state >> 8) / 8388608.0 - 1;
  }
  MatrixXd U = OrthonormalColumns(A * V);
  for (int round = 0; round < 2; ++round) U = OrthonormalColumns(A * (A.transpose() * U));
  const MatrixXd B = U.transpose() * A;
  const SymmetricEigen eigen = EigenOfSymmetric(B * B.transpose());
  const Eigen::Index kept = std::min<Eigen::Index>(count, k);
  return U * (eigen.vectors.rightCols(kept).rowwise().reverse() *
              eigen.values.tail(kept).reverse().cwiseMax(0).cwiseSqrt().asDiagonal());
}

}  // namespace

Signals SignalsOf(const FrameStack& stack, const std::vector<int>& frames, const MatrixXd& camera, const PixelAt& pixel,
                  const SignalsOptions& options) {
  CheckInterrupted();
  const int pixels = stack.width * stack.height;
  const auto n = static_cast<Eigen::Index>(frames.size());
  Signals signals;
  signals.video_frames = stack.count();
  signals.frame = frames;
  signals.time.resize(n);
  for (Eigen::Index i = 0; i < n; ++i)
    signals.time[i] = stack.time[static_cast<std::size_t>(frames[static_cast<std::size_t>(i)])];
  MatrixXd nuisance(n, 1 + camera.cols());
  nuisance.col(0).setOnes();
  if (camera.cols() > 0) nuisance.rightCols(camera.cols()) = camera;
  signals.nuisance = OrthonormalSpan(nuisance);

  VectorXd gain = Gains(pixels, frames, pixel);
  if (const std::vector<Eigen::Index> lit = LitFrames(gain); lit.size() < frames.size()) {
    std::vector<int> of_lit;
    for (const Eigen::Index i : lit) of_lit.push_back(frames[static_cast<std::size_t>(i)]);
    return SignalsOf(stack, of_lit, camera(lit, Eigen::all), pixel, options);
  }
  const double spread = std::sqrt((gain.array() - gain.mean()).square().mean());
  if (spread >= kMinGainSpread)
    signals.gain_spread = spread;
  else
    gain.setOnes();
  const Columns columns(frames, pixel, gain);

  std::vector<double> variance(static_cast<std::size_t>(pixels) * 3, -1), mean(variance.size(), 0);
  ParallelFor(static_cast<std::size_t>(pixels), 64, [&](std::size_t begin, std::size_t end) {
    Column c[3];
    for (std::size_t p = begin; p < end; ++p) {
      columns.Get(static_cast<int>(p), c);
      for (std::size_t k = 0; k < 3; ++k) {
        if (c[k].seen < kMinSeenShare) continue;
        const VectorXd rest = c[k].value - signals.nuisance * (signals.nuisance.transpose() * c[k].value);
        variance[3 * p + k] = rest.squaredNorm() / static_cast<double>(n);
        mean[3 * p + k] = c[k].mean;
      }
    }
  });
  std::vector<double> known;
  for (const double v : variance)
    if (v >= 0) known.push_back(v);
  if (known.empty())
    throw DataError("no part of the picture is seen throughout the video",
                    "film so that the moving part stays in view");
  const double floor = Quantile(known, 0.25);
  std::vector<std::pair<double, std::size_t>> moving;
  for (std::size_t i = 0; i < variance.size(); ++i) {
    if (variance[i] < 0) continue;
    double least = std::max(options.min_deviation * options.min_deviation, options.noise_factor * floor);
    if (camera.cols() > 0) {
      const auto p = static_cast<int>(i / 3);
      const int x = p % stack.width, y = p / stack.width;
      const auto at = [&](int u, int v) {
        u = std::clamp(u, 0, stack.width - 1), v = std::clamp(v, 0, stack.height - 1);
        return mean[3 * static_cast<std::size_t>(v * stack.width + u) + i % 3];
      };
      const double gx = 0.5 * (at(x + 1, y) - at(x - 1, y)), gy = 0.5 * (at(x, y + 1) - at(x, y - 1));
      least += options.noise_factor * kMisplaced_px * kMisplaced_px * (gx * gx + gy * gy);
    }
    if (variance[i] > least) moving.emplace_back(-variance[i] / least * std::sqrt(variance[i]), i);
  }
  // A handful of pixels is a fly, or a fault of the sensor.
  const auto enough = static_cast<std::size_t>(std::max(6, pixels / 4000));
  if (moving.size() < enough)
    throw DataError(camera.cols() > 0 ? "nothing moves against the background in this video, so that it has no period"
                                      : "nothing moves in this video, so that it has no period",
                    "film the scene while it moves, the moving part large in the picture");
  signals.moving_share = static_cast<double>(moving.size()) / static_cast<double>(known.size());
  std::ranges::sort(moving);
  moving.resize(std::min<std::size_t>(moving.size(), static_cast<std::size_t>(options.pixels)));
  std::vector<double> deviations;
  for (const auto& m : moving) deviations.push_back(std::sqrt(variance[m.second]));
  signals.moving_deviation = Quantile(deviations, 0.5);

  MatrixXd A(n, static_cast<Eigen::Index>(moving.size()));
  ParallelFor(moving.size(), 16, [&](std::size_t begin, std::size_t end) {
    Column c[3];
    for (std::size_t j = begin; j < end; ++j) {
      columns.Get(static_cast<int>(moving[j].second / 3), c);
      const VectorXd& v = c[moving[j].second % 3].value;
      A.col(static_cast<Eigen::Index>(j)) = v - signals.nuisance * (signals.nuisance.transpose() * v);
    }
  });
  signals.values = PrincipalComponents(A, options.components) / std::sqrt(static_cast<double>(moving.size()));
  return signals;
}

Signals FixedSignals(const FrameStack& stack, const SignalsOptions& options) {
  std::vector<int> frames(stack.frames.size());
  std::iota(frames.begin(), frames.end(), 0);
  const auto pixel = [&](int frame, int p, float* rgb) {
    const std::uint8_t* from =
        stack.frames[static_cast<std::size_t>(frame)].data.data() + 3 * static_cast<std::ptrdiff_t>(p);
    for (int k = 0; k < 3; ++k) rgb[k] = from[k];
  };
  return SignalsOf(stack, frames, MatrixXd(static_cast<Eigen::Index>(frames.size()), 0), pixel, options);
}

}  // namespace lumi
