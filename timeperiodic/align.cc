#include "timeperiodic/align.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "scene/geometry/dense_solvers.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;
using Points = std::vector<cv::Point2f>;

constexpr int kWindow_px = 13, kLevels = 3, kIterations = 12;
constexpr float kForwardBackward_px = 0.4F;
constexpr double kPatchCorrelation = 0.7;
constexpr int kPatchRadius_px = 4;
constexpr double kModeRms_px = 0.08;  // displacement that a mode must be worth
constexpr double kOutlier_px = 0.6;   // of a corner from its modes, at least; beyond 4 medians too
constexpr double kMinFoundShare =
    0.25;                       // of the frames, in which a corner that stands still is found where it should be
constexpr int kMinPoints = 10;  // of a frame ...
constexpr double kMinPointsShare = 0.1;    // ... and of all corners
constexpr Eigen::Index kNearCorners = 10;  // the distance to so many of them is how far a node looks ...
constexpr double kLeastReach = 0.05;       // ... of the picture's width, at least
constexpr double kSlopeRidge = 0.05;       // of the square of that: what a slope between corners has to be worth
constexpr Eigen::Index kModulations = 2;   // modes of the camera that change the look of what moves
constexpr int kNode_px = 8;                // modes are interpolated at nodes so far apart

// Grey, with the mean and contrast of the reference: exposure is not motion.
cv::Mat GreyOf(const Image8& rgb) {
  const cv::Mat view(rgb.height, rgb.width, CV_8UC3, const_cast<std::uint8_t*>(rgb.data.data()));
  cv::Mat grey;
  cv::cvtColor(view, grey, cv::COLOR_RGB2GRAY);
  return grey;
}
cv::Mat Equalised(const cv::Mat& grey, double mean, double deviation) {
  cv::Scalar m, d;
  cv::meanStdDev(grey, m, d);
  cv::Mat out;
  const double gain = d[0] > 1 ? deviation / d[0] : 1;
  grey.convertTo(out, CV_8U, gain, mean - gain * m[0]);
  return out;
}

using Pyramid = std::vector<cv::Mat>;
Pyramid PyramidOf(const cv::Mat& grey) {
  Pyramid pyramid;
  cv::buildOpticalFlowPyramid(grey, pyramid, {kWindow_px, kWindow_px}, kLevels);
  return pyramid;
}

// There and back: true where the corner is found again.
std::vector<char> Follow(const Pyramid& from, const Pyramid& to, const Points& start, Points& end) {
  std::vector<unsigned char> there, here;
  std::vector<float> error;
  Points back = start;
  const cv::Size window(kWindow_px, kWindow_px);
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kIterations, 0.01);
  cv::calcOpticalFlowPyrLK(from, to, start, end, there, error, window, kLevels, criteria, cv::OPTFLOW_USE_INITIAL_FLOW);
  cv::calcOpticalFlowPyrLK(to, from, end, back, here, error, window, kLevels, criteria, cv::OPTFLOW_USE_INITIAL_FLOW);
  std::vector<char> found(start.size());
  for (std::size_t i = 0; i < start.size(); ++i)
    found[i] = there[i] && here[i] && std::hypot(back[i].x - start[i].x, back[i].y - start[i].y) < kForwardBackward_px;
  return found;
}

double PatchCorrelation(const cv::Mat& a, const cv::Point2f& x, const cv::Mat& b, const cv::Point2f& y) {
  const int side = 2 * kPatchRadius_px + 1;
  cv::Mat p, q;
  cv::getRectSubPix(a, {side, side}, x, p, CV_32F);
  cv::getRectSubPix(b, {side, side}, y, q, CV_32F);
  cv::Mat rho;
  cv::matchTemplate(p, q, rho, cv::TM_CCOEFF_NORMED);
  return static_cast<double>(rho.at<float>(0, 0));
}

Points CornersOf(const cv::Mat& grey, int count) {
  Points corners;
  const double distance = std::max(3.0, 0.5 * std::sqrt(static_cast<double>(grey.total()) / count));
  cv::goodFeaturesToTrack(grey, corners, count, 0.005, distance, cv::noArray(), 5);
  return corners;
}

// A similarity from one frame to the next, as 2x3; the identity where too few corners can be followed.
cv::Matx23d Step(const cv::Mat& a, const Pyramid& pa, const Pyramid& pb) {
  const Points corners = CornersOf(a, 120);
  if (corners.size() >= 8) {
    Points end = corners;
    const auto found = Follow(pa, pb, corners, end);
    Points from, to;
    for (std::size_t i = 0; i < corners.size(); ++i)
      if (found[i]) from.push_back(corners[i]), to.push_back(end[i]);
    if (from.size() >= 8) {
      const cv::Mat m = cv::estimateAffinePartial2D(from, to, cv::noArray(), cv::RANSAC, 1.5);
      if (!m.empty()) return cv::Matx23d(m.ptr<double>());
    }
  }
  return {1, 0, 0, 0, 1, 0};
}
cv::Point2f Apply(const cv::Matx23d& m, const cv::Point2f& x) {
  return {static_cast<float>(m(0, 0) * x.x + m(0, 1) * x.y + m(0, 2)),
          static_cast<float>(m(1, 0) * x.x + m(1, 1) * x.y + m(1, 2))};
}
cv::Matx23d Inverse(const cv::Matx23d& m) {
  cv::Matx23d out;
  cv::invertAffineTransform(m, out);
  return out;
}

// Displacements of the reference's corners in every frame, x then y; which of them were seen.
struct Displacements {
  MatrixXd value;                                            // frames x 2 corners
  Eigen::Matrix<char, Eigen::Dynamic, Eigen::Dynamic> seen;  // frames x corners
};

// The modes of the displacements, robustly: what was not seen, or fits no mode, is filled in from the modes.
struct Modes {
  VectorXd mean;  // 2 corners
  MatrixXd V;     // 2 corners x modes, orthonormal
  MatrixXd c;     // frames x modes
  double residual_px = 0;
};

Modes FitModes(Displacements& d, int count) {
  const Eigen::Index n = d.value.rows(), m = d.seen.cols();
  MatrixXd W = d.value;
  Modes modes;
  const Eigen::Index k = std::min<Eigen::Index>({count, 2 * m, n});
  modes.V = MatrixXd::Zero(2 * m, k);
  std::uint32_t state = 99;
  for (Eigen::Index i = 0; i < modes.V.size(); ++i) {
    state = state * 1664525U + 1013904223U;
    modes.V.data()[i] = static_cast<double>(state >> 8) / 8388608.0 - 1;
  }
  modes.V = OrthonormalColumns(modes.V);
  for (int round = 0; round < 30; ++round) {
    CheckInterrupted();
    modes.mean = W.colwise().mean();
    const MatrixXd centred = W.rowwise() - modes.mean.transpose();
    for (int power = 0; power < 2; ++power) modes.V = OrthonormalColumns(centred.transpose() * (centred * modes.V));
    modes.c = centred * modes.V;
    const MatrixXd fitted = (modes.c * modes.V.transpose()).rowwise() + modes.mean.transpose();
    std::vector<double> rest;
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < m; ++j)
        if (d.seen(i, j))
          rest.push_back(std::hypot(d.value(i, j) - fitted(i, j), d.value(i, m + j) - fitted(i, m + j)));
    if (rest.empty()) break;
    modes.residual_px = Median(std::move(rest));
    // Wide at first, while the modes are not yet those of the camera.
    const double limit = std::max(kOutlier_px, 4 * modes.residual_px) * (round < 4 ? 3 : 1);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j < m; ++j) {
        const bool good =
            d.seen(i, j) && std::hypot(d.value(i, j) - fitted(i, j), d.value(i, m + j) - fitted(i, m + j)) < limit;
        W(i, j) = good ? d.value(i, j) : fitted(i, j);
        W(i, m + j) = good ? d.value(i, m + j) : fitted(i, m + j);
        if (round == 29 && !good) d.seen(i, j) = 0;
      }
  }
  // Strongest first.
  const SymmetricEigen eigen = EigenOfSymmetric(modes.c.transpose() * modes.c);
  const MatrixXd R = eigen.vectors.rowwise().reverse();
  modes.V = modes.V * R;
  modes.c = modes.c * R;
  return modes;
}

Displacements Selected(const Displacements& d, const std::vector<Eigen::Index>& rows,
                       const std::vector<Eigen::Index>& corners) {
  const Eigen::Index m = d.seen.cols();
  std::vector<Eigen::Index> columns = corners;
  for (const Eigen::Index j : corners) columns.push_back(m + j);
  return {d.value(rows, columns), d.seen(rows, corners)};
}

// Affine maps from each frame to the next, [i + 1] from i.
std::vector<cv::Matx23d> StepsBetween(const std::vector<cv::Mat>& grey, Progress& progress) {
  std::vector<cv::Matx23d> step(grey.size());
  ParallelFor(grey.size() - 1, 8, [&](std::size_t begin, std::size_t end) {
    Pyramid before = PyramidOf(grey[begin]);
    for (std::size_t i = begin; i < end; ++i) {
      Pyramid after = PyramidOf(grey[i + 1]);
      step[i + 1] = Step(grey[i], before, after);
      before = std::move(after);
      progress.Step();
    }
  });
  return step;
}

// The frame whose picture's middle is nearest to the median of all frames' middles.
std::size_t UsualFrame(const std::vector<cv::Matx23d>& step, const cv::Size& size) {
  cv::Point2f at(0.5F * static_cast<float>(size.width), 0.5F * static_cast<float>(size.height));
  std::vector<double> xs, ys;
  for (std::size_t i = 0; i < step.size(); ++i) {
    if (i > 0) at = Apply(step[i], at);
    xs.push_back(static_cast<double>(at.x));
    ys.push_back(static_cast<double>(at.y));
  }
  const double mx = Median(xs), my = Median(ys);
  std::size_t usual = 0;
  for (std::size_t i = 0; i < xs.size(); ++i)
    if (std::hypot(xs[i] - mx, ys[i] - my) < std::hypot(xs[usual] - mx, ys[usual] - my)) usual = i;
  return usual;
}

// The reference's own corners in every frame, outwards from the reference. A corner is searched for at its place in the
// neighbouring frame, moved by the step between the two; the patch that is searched for is always the reference's, so
// that nothing drifts.
Displacements FollowCorners(const std::vector<cv::Mat>& grey, const std::vector<cv::Matx23d>& step,
                            std::size_t reference, const Points& corners, Progress& progress) {
  const auto n = static_cast<Eigen::Index>(grey.size()), m = static_cast<Eigen::Index>(corners.size());
  const cv::Mat& base = grey[reference];
  const Pyramid base_pyramid = PyramidOf(base);
  cv::Scalar mean, deviation;
  cv::meanStdDev(base, mean, deviation);
  Displacements d{MatrixXd::Zero(n, 2 * m), Eigen::Matrix<char, Eigen::Dynamic, Eigen::Dynamic>::Zero(n, m)};
  d.seen.row(static_cast<Eigen::Index>(reference)).setOnes();
  ParallelEach(2, 1, [&](std::size_t direction) {
    Points guess = corners;
    const std::ptrdiff_t by = direction == 0 ? 1 : -1;
    for (std::ptrdiff_t i = static_cast<std::ptrdiff_t>(reference) + by; i >= 0 && i < n; i += by) {
      const auto frame = static_cast<std::size_t>(i);
      const cv::Matx23d move = by > 0 ? step[frame] : Inverse(step[frame + 1]);
      for (cv::Point2f& x : guess) x = Apply(move, x);
      const cv::Mat now = Equalised(grey[frame], mean[0], deviation[0]);
      Points end_points = guess;
      const auto found = Follow(base_pyramid, PyramidOf(now), corners, end_points);
      for (Eigen::Index j = 0; j < m; ++j) {
        const auto c = static_cast<std::size_t>(j);
        const cv::Point2f& x = end_points[c];
        const bool inside =
            x.x >= 0 && x.y >= 0 && x.x < static_cast<float>(base.cols) && x.y < static_cast<float>(base.rows);
        const bool good = found[c] && inside && PatchCorrelation(base, corners[c], now, x) > kPatchCorrelation;
        if (good) guess[c] = x;
        d.seen(i, j) = good;
        d.value(i, j) = static_cast<double>(guess[c].x - corners[c].x);
        d.value(i, m + j) = static_cast<double>(guess[c].y - corners[c].y);
      }
      progress.Step();
    }
  });
  return d;
}

std::vector<Eigen::Index> FramesWithEnough(const Displacements& s) {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index i = 0; i < s.seen.rows(); ++i)
    if (s.seen.row(i).cast<int>().sum() >=
        std::max<int>(kMinPoints, static_cast<int>(kMinPointsShare * static_cast<double>(s.seen.cols()))))
      rows.push_back(i);
  return rows;
}

std::vector<Eigen::Index> CornersWithEnough(const Displacements& s) {
  std::vector<Eigen::Index> columns;
  for (Eigen::Index j = 0; j < s.seen.cols(); ++j)
    if (s.seen.col(j).cast<int>().sum() >= kMinFoundShare * static_cast<double>(s.seen.rows())) columns.push_back(j);
  return columns;
}

// What stands still, and how the camera moves it.
struct StillBackground {
  std::vector<Eigen::Index> rows, kept;  // frames, corners
  Displacements used;                    // of both
  Modes modes;
};

StillBackground FindStill(const Displacements& d, const AlignOptions& options, int reference, const DataError& little) {
  const Eigen::Index n = d.seen.rows();
  const auto enough = [&](std::size_t aligned) {
    if (static_cast<double>(aligned) < options.min_aligned * static_cast<double>(n))
      throw DataError(
          fmt::format(
              "the background of {} of {} frames cannot be found again in frame {}: too little of it stands still, or "
              "the camera goes too far",
              n - static_cast<Eigen::Index>(aligned), n, reference),
          "keep the same still, textured background in view, or film the period from a tripod");
  };
  StillBackground b{FramesWithEnough(d), std::vector<Eigen::Index>(static_cast<std::size_t>(d.seen.cols())), {}, {}};
  std::iota(b.kept.begin(), b.kept.end(), Eigen::Index{0});
  enough(b.rows.size());
  for (int round = 0; round < 2; ++round) {
    b.used = Selected(d, b.rows, b.kept);
    b.modes = FitModes(b.used, options.modes);
    std::vector<Eigen::Index> still;
    for (const Eigen::Index j : CornersWithEnough(b.used)) still.push_back(b.kept[static_cast<std::size_t>(j)]);
    if (static_cast<int>(still.size()) < options.min_corners) throw little;
    if (round == 1 || still.size() == b.kept.size()) break;
    b.kept = still;
    std::vector<Eigen::Index> better;
    for (const Eigen::Index i : FramesWithEnough(Selected(d, b.rows, b.kept)))
      better.push_back(b.rows[static_cast<std::size_t>(i)]);
    b.rows = better;
    enough(b.rows.size());
  }
  return b;
}

// Modes worth keeping, scaled to unit variance: alignment.camera. What they do to the corners: x, y of the mean and of
// each mode.
MatrixXd KeepModes(const StillBackground& b, Alignment& alignment) {
  const Modes& modes = b.modes;
  const auto count = static_cast<double>(b.rows.size());
  const auto corners = static_cast<Eigen::Index>(b.kept.size());
  Eigen::Index kept = 0;
  while (kept < modes.c.cols() &&
         modes.c.col(kept).norm() / std::sqrt(count * static_cast<double>(corners)) > kModeRms_px)
    ++kept;
  alignment.camera.resize(modes.c.rows(), kept);
  MatrixXd at_corners(corners, 2 * (1 + kept));
  at_corners.col(0) = modes.mean.head(corners);
  at_corners.col(1) = modes.mean.tail(corners);
  for (Eigen::Index k = 0; k < kept; ++k) {
    const double s = modes.c.col(k).norm() / std::sqrt(count);
    alignment.camera.col(k) = modes.c.col(k) / s;
    at_corners.col(2 + 2 * k) = s * modes.V.col(k).head(corners);
    at_corners.col(3 + 2 * k) = s * modes.V.col(k).tail(corners);
  }
  return at_corners;
}

// Between corners: an affine map fitted to those around each node of a grid, bilinear between nodes.
void SpreadModes(const Points& corners, const MatrixXd& at_corners, Alignment& alignment) {
  const int gw = alignment.width / kNode_px + 2, gh = alignment.height / kNode_px + 2;
  const auto count = static_cast<Eigen::Index>(corners.size());
  std::vector<MatrixXd> node(static_cast<std::size_t>(gw * gh));
  ParallelEach(node.size(), 4, [&](std::size_t g) {
    const double x = kNode_px * static_cast<double>(static_cast<int>(g) % gw),
                 y = kNode_px * static_cast<double>(static_cast<int>(g) / gw);
    MatrixXd B(count, 3);
    VectorXd d2(count);
    for (Eigen::Index j = 0; j < count; ++j) {
      const cv::Point2f& c = corners[static_cast<std::size_t>(j)];
      B.row(j) << 1, (static_cast<double>(c.x) - x) / alignment.width, (static_cast<double>(c.y) - y) / alignment.width;
      d2[j] = B.row(j).tail(2).squaredNorm();
    }
    const auto near = static_cast<std::size_t>(std::min<Eigen::Index>(kNearCorners, count - 1));
    const double s2 = std::max(kLeastReach * kLeastReach, NthSmallest(std::vector<double>(d2.begin(), d2.end()), near));
    const VectorXd w = (-0.5 * d2 / s2).array().exp();
    MatrixXd G = B.transpose() * w.asDiagonal() * B;
    G(1, 1) += kSlopeRidge * s2 * w.sum();  // far from all corners: their mean rather than a slope of theirs
    G(2, 2) += kSlopeRidge * s2 * w.sum();
    node[g] = SolveSymmetric(G, B.transpose() * w.asDiagonal() * at_corners).row(0);
  });
  const Eigen::Index pixels = static_cast<Eigen::Index>(alignment.width) * alignment.height,
                     modes = at_corners.cols() / 2;
  alignment.mode_x.resize(pixels, modes);
  alignment.mode_y.resize(pixels, modes);
  for (Eigen::Index p = 0; p < pixels; ++p) {
    const double x = static_cast<double>(p % alignment.width) / kNode_px,
                 y = static_cast<double>(p / alignment.width) / kNode_px;
    const int i = static_cast<int>(x), j = static_cast<int>(y);
    const double u = x - i, v = y - j;
    const auto at_node = [&](int a, int b) -> const MatrixXd& { return node[static_cast<std::size_t>(b * gw + a)]; };
    const MatrixXd value = (1 - v) * ((1 - u) * at_node(i, j) + u * at_node(i + 1, j)) +
                           v * ((1 - u) * at_node(i, j + 1) + u * at_node(i + 1, j + 1));
    for (Eigen::Index k = 0; k < modes; ++k) {
      alignment.mode_x(p, k) = static_cast<float>(value(0, 2 * k));
      alignment.mode_y(p, k) = static_cast<float>(value(0, 2 * k + 1));
    }
  }
}

}  // namespace

Eigen::Vector2f Alignment::InFrame(Eigen::Index row, int pixel) const {
  float x = static_cast<float>(pixel % width) + mode_x(pixel, 0),
        y = static_cast<float>(pixel / width) + mode_y(pixel, 0);
  for (Eigen::Index k = 0; k < camera.cols(); ++k) {
    const auto c = static_cast<float>(camera(row, k));
    x += c * mode_x(pixel, 1 + k);
    y += c * mode_y(pixel, 1 + k);
  }
  return {x, y};
}

Eigen::Index Alignment::RowOf(int frame) const {
  const auto at = std::ranges::lower_bound(frames, frame);
  return at != frames.end() && *at == frame ? at - frames.begin() : -1;
}

Alignment AlignFrames(const FrameStack& stack, const AlignOptions& options, ProgressSink& sink) {
  const auto n = static_cast<Eigen::Index>(stack.frames.size());
  const DataError little("too little of the picture stands still to align the frames by",
                         "film with more of a still, textured background in view, or use a tripod");
  if (n < 3) throw DataError("the video has too few frames", "film several periods");
  std::vector<cv::Mat> grey(stack.frames.size());
  ParallelEach(grey.size(), 16, [&](std::size_t i) { grey[i] = GreyOf(stack.frames[i]); });
  Progress progress(sink, "following the background", 2 * static_cast<long>(n));
  const std::vector<cv::Matx23d> step = StepsBetween(grey, progress);
  const std::size_t reference = UsualFrame(step, grey[0].size());
  const Points corners = CornersOf(grey[reference], options.corners);
  if (static_cast<int>(corners.size()) < options.min_corners) throw little;
  const Displacements displacements = FollowCorners(grey, step, reference, corners, progress);

  Alignment alignment;
  alignment.reference = static_cast<int>(reference);
  alignment.width = stack.width;
  alignment.height = stack.height;
  const StillBackground background = FindStill(displacements, options, alignment.reference, little);
  alignment.corners = static_cast<int>(background.kept.size());
  alignment.residual_px = background.modes.residual_px;
  for (const Eigen::Index i : background.rows) alignment.frames.push_back(static_cast<int>(i));
  const MatrixXd& moved = background.used.value;
  alignment.motion_px =
      std::sqrt(2 * moved.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, moved.size())));
  Points still;
  for (const Eigen::Index j : background.kept) still.push_back(corners[static_cast<std::size_t>(j)]);
  SpreadModes(still, KeepModes(background, alignment), alignment);
  return alignment;
}

PixelAt AlignedPixels(const FrameStack& stack, const Alignment& alignment) {
  return [&stack, &alignment](int frame, int pixel, float* rgb) {
    rgb[0] = rgb[1] = rgb[2] = -1;
    const Eigen::Index row = alignment.RowOf(frame);
    if (row < 0) return;
    const Eigen::Vector2f x = alignment.InFrame(row, pixel);
    const Image8& image = stack.frames[static_cast<std::size_t>(frame)];
    const int i = static_cast<int>(std::floor(x.x())), j = static_cast<int>(std::floor(x.y()));
    if (i < 0 || j < 0 || i + 1 >= image.width || j + 1 >= image.height) return;
    const float u = x.x() - static_cast<float>(i), v = x.y() - static_cast<float>(j);
    const std::uint8_t *a = image.Row(j) + 3 * i, *b = image.Row(j + 1) + 3 * i;
    for (int k = 0; k < 3; ++k)
      rgb[k] = (1 - v) * ((1 - u) * static_cast<float>(a[k]) + u * static_cast<float>(a[k + 3])) +
               v * ((1 - u) * static_cast<float>(b[k]) + u * static_cast<float>(b[k + 3]));
  };
}

MatrixXd CameraCovariates(const Alignment& alignment) {
  const MatrixXd& c = alignment.camera;
  const Eigen::Index strong = std::min<Eigen::Index>(3, c.cols());
  MatrixXd all(c.rows(), c.cols() + strong * (strong + 1) / 2 + strong);
  all.leftCols(c.cols()) = c;
  Eigen::Index at = c.cols();
  for (Eigen::Index a = 0; a < strong; ++a)
    for (Eigen::Index b = a; b < strong; ++b) all.col(at++) = c.col(a).cwiseProduct(c.col(b));
  for (Eigen::Index a = 0; a < strong; ++a) all.col(at++) = c.col(a).array().cube();
  return all;
}

Signals MovingSignals(const FrameStack& stack, const Alignment& alignment, const SignalsOptions& options) {
  Signals signals =
      SignalsOf(stack, alignment.frames, CameraCovariates(alignment), AlignedPixels(stack, alignment), options);
  signals.modulation = alignment.camera.leftCols(std::min<Eigen::Index>(kModulations, alignment.camera.cols()));
  return signals;
}

}  // namespace lumi
