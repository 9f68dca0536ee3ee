#include "scene/tracks/affine_patch.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "scene/geometry/dense_solvers.h"
#include "scene/program/kernel.h"

namespace lumi {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Grey levels: below this deviation a patch is noise.
constexpr double kMinDeviation = 1.5;
// Damping of the affine part relative to its own curvature: what the patch does not determine stays as it was.
constexpr double kAffineDamping = 0.01;
// The weights' standard deviation in units of the radius.
constexpr double kWindow = 0.8;
constexpr double kMinRcond = 1e-6;
constexpr int kMostAlignSteps = 15;
constexpr double kSettledPx = 0.003;
// A patch with a step beyond this is lost: the tracker's own step is good to a fraction of a pixel.
constexpr double kMaxWanderPx = 3;
constexpr double kMaxScale = 2.5, kMaxStretch = 3;

// Bilinear; x and y in OpenCV's sense (first centre at 0). The caller ensures that they lie inside.
inline float Sample(const ImageF& image, double x, double y) {
  const int ix = static_cast<int>(x), iy = static_cast<int>(y);
  const float fx = static_cast<float>(x - ix), fy = static_cast<float>(y - iy);
  const float* a = image.Row(iy) + ix;
  const float* b = a + image.width;
  const float top = a[0] + fx * (a[1] - a[0]), bottom = b[0] + fx * (b[1] - b[0]);
  return top + fy * (bottom - top);
}

// Places rounded to floats stay inside.
constexpr double kEdgePx = 1e-3;

// Whether the square |d| <= r under A around x lies where Sample may read.
bool Inside(const ImageF& image, const PatchPose& pose, double r) {
  const Eigen::Vector2d half = pose.A.cwiseAbs() * Eigen::Vector2d::Constant(r);
  const Eigen::Vector2d lo = pose.x_px.array() - 0.5 - half.array(), hi = pose.x_px.array() - 0.5 + half.array();
  return lo.x() >= 0 && lo.y() >= 0 && hi.x() < image.width - 1 - kEdgePx && hi.y() < image.height - 1 - kEdgePx;
}

// Sums over a patch keep the same number of partial sums on every processor, so that the order of additions is always
// the same.
typedef float Lanes __attribute__((vector_size(4 * kPatchLanes), aligned(4)));  // NOLINT(modernize-use-using)

LUMI_INLINE Lanes Load(const float* from) {
  Lanes lanes;
  __builtin_memcpy(&lanes, from, sizeof lanes);
  return lanes;
}

LUMI_INLINE double SumOf(const Lanes& lanes) {
  double sum = 0;
  for (int l = 0; l < kPatchLanes; ++l) sum += static_cast<double>(lanes[l]);
  return sum;
}

// image[y][x] bilinearly at x = x0 + a0 dx + a1 dy and so on; x and y relative to `origin`, not negative.
LUMI_KERNEL void SampleAffine(const float* origin, int stride, std::size_t count, const float* dx, const float* dy,
                              const float* map, float* seen) {
  const float x0 = map[0], y0 = map[1], a00 = map[2], a01 = map[3], a10 = map[4], a11 = map[5];
  for (std::size_t i = 0; i < count; ++i) {
    const float x = x0 + a00 * dx[i] + a01 * dy[i], y = y0 + a10 * dx[i] + a11 * dy[i];
    const int ix = static_cast<int>(x), iy = static_cast<int>(y), at = iy * stride + ix;
    const float fx = x - static_cast<float>(ix), fy = y - static_cast<float>(iy);
    const float top = origin[at] + fx * (origin[at + 1] - origin[at]);
    const float bottom = origin[at + stride] + fx * (origin[at + stride + 1] - origin[at + stride]);
    seen[i] = top + fy * (bottom - top);
  }
}

// Places are relative to the patch's own corner of the frame: floats then hold them to a millionth of a pixel.
void SampleUnder(const ImageF& image, const PatchPose& pose, double r, std::size_t count, const float* dx,
                 const float* dy, float* seen) {
  const Eigen::Vector2d centre = pose.x_px - Eigen::Vector2d(0.5, 0.5);  // OpenCV's sense
  const Eigen::Vector2d corner = centre - pose.A.cwiseAbs() * Eigen::Vector2d::Constant(r);
  const int bx = static_cast<int>(corner.x()), by = static_cast<int>(corner.y());
  const std::array map{static_cast<float>(centre.x() - bx), static_cast<float>(centre.y() - by),
                       static_cast<float>(pose.A(0, 0)),    static_cast<float>(pose.A(0, 1)),
                       static_cast<float>(pose.A(1, 0)),    static_cast<float>(pose.A(1, 1))};
  SampleAffine(image.Row(by) + bx, image.width, count, dx, dy, map.data(), seen);
}

LUMI_KERNEL double WeightedMean(const float* weight, const float* seen, std::size_t count) {
  Lanes sum{};
  for (std::size_t i = 0; i < count; i += kPatchLanes) sum += Load(weight + i) * Load(seen + i);
  return SumOf(sum);
}

LUMI_KERNEL double WeightedSquare(const float* weight, const float* seen, float mean, std::size_t count) {
  Lanes sum{};
  for (std::size_t i = 0; i < count; i += kPatchLanes) {
    const Lanes off = Load(seen + i) - mean;
    sum += Load(weight + i) * off * off;
  }
  return SumOf(sum);
}

struct Comparison {
  double correlation;
  std::array<double, 6> b;  // the gradient that a step follows
};
LUMI_KERNEL Comparison Compare(const float* value, const float* weight, const float* steepest, const float* seen,
                               float mean, float scale, std::size_t count) {
  Lanes correlation{};
  std::array<Lanes, 6> b{};
  for (std::size_t i = 0; i < count; i += kPatchLanes) {
    const Lanes first = Load(value + i), now = (Load(seen + i) - mean) * scale, error = now - first;
    correlation += Load(weight + i) * first * now;
    for (std::size_t k = 0; k < 6; ++k) b[k] += error * Load(steepest + k * count + i);
  }
  Comparison c{SumOf(correlation), {}};
  for (std::size_t k = 0; k < 6; ++k) c.b[k] = SumOf(b[k]);
  return c;
}

bool IsViewOfAPatch(const Eigen::Matrix2d& A) {
  const double det = A.determinant();
  if (!(det > 1 / (kMaxScale * kMaxScale)) || !(det < kMaxScale * kMaxScale)) return false;
  // Largest singular value without cancellation; the smallest is det / largest.
  const double largest =
      (std::hypot(A(0, 0) + A(1, 1), A(0, 1) - A(1, 0)) + std::hypot(A(0, 0) - A(1, 1), A(0, 1) + A(1, 0))) / 2;
  return largest * largest < kMaxStretch * det;
}

}  // namespace

std::optional<AffinePatch> TakePatch(const ImageF& grey, const Eigen::Vector2d& x_px, int radius_px) {
  const int r = radius_px, side = 2 * r + 1, ring = side + 2;
  if (!x_px.allFinite() || !Inside(grey, {x_px, Eigen::Matrix2d::Identity()}, r + 1)) return std::nullopt;
  // One pixel more on each side, for differences.
  std::vector<float> raw(static_cast<std::size_t>(ring * ring));
  for (int y = 0; y < ring; ++y)
    for (int x = 0; x < ring; ++x)
      raw[static_cast<std::size_t>(y * ring + x)] =
          Sample(grey, x_px.x() - 0.5 + x - r - 1, x_px.y() - 0.5 + y - r - 1);
  const auto at = [&](int x, int y) { return raw[static_cast<std::size_t>((y + 1) * ring + x + 1)]; };

  AffinePatch patch;
  patch.radius_px = r;
  const auto n = static_cast<std::size_t>(side * side);
  const std::size_t padded = (n + kPatchLanes - 1) / kPatchLanes * kPatchLanes;
  patch.value.resize(padded);
  patch.weight.resize(padded);
  patch.steepest.resize(6 * padded);
  double sum = 0, mean = 0, square = 0;
  const double sigma = kWindow * r;
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const double dx = x - r, dy = y - r, w = std::exp(-(dx * dx + dy * dy) / (2 * sigma * sigma));
      patch.weight[static_cast<std::size_t>(y * side + x)] = static_cast<float>(w);
      sum += w;
    }
  for (std::size_t i = 0; i < n; ++i) {
    patch.weight[i] = static_cast<float>(patch.weight[i] / sum);
    mean += patch.weight[i] * at(static_cast<int>(i) % side, static_cast<int>(i) / side);
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double v = at(static_cast<int>(i) % side, static_cast<int>(i) / side) - mean;
    square += patch.weight[i] * v * v;
  }
  const double deviation = std::sqrt(square);
  if (!(deviation > kMinDeviation)) return std::nullopt;

  std::vector<Vector6d> J(n);
  Vector6d j_mean = Vector6d::Zero(), j_value = Vector6d::Zero();
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const auto i = static_cast<std::size_t>(y * side + x);
      const double gx = (at(x + 1, y) - at(x - 1, y)) / (2 * deviation),
                   gy = (at(x, y + 1) - at(x, y - 1)) / (2 * deviation);
      const double dx = x - r, dy = y - r;
      patch.value[i] = static_cast<float>((at(x, y) - mean) / deviation);
      J[i] << gx * dx, gx * dy, gy * dx, gy * dy, gx, gy;
      j_mean += patch.weight[i] * J[i];
      j_value += patch.weight[i] * patch.value[i] * J[i];
    }
  // A brighter or more contrasty frame is not a movement: what gain and offset explain leaves the derivatives.
  Matrix6d H = Matrix6d::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    J[i] -= j_mean + patch.value[i] * j_value;
    H += patch.weight[i] * J[i] * J[i].transpose();
    for (int k = 0; k < 6; ++k)
      patch.steepest[static_cast<std::size_t>(k) * padded + i] = static_cast<float>(patch.weight[i] * J[i][k]);
  }
  const Eigen::Matrix2d shift = H.bottomRightCorner<2, 2>();
  const double trace = shift.trace(), det = shift.determinant();
  const double gap = std::sqrt(std::max(0.0, trace * trace / 4 - det));
  if (!(trace / 2 - gap > 1e-3 * (trace / 2 + gap))) return std::nullopt;  // an edge: it slides along itself
  H.diagonal().head<4>() *= 1 + kAffineDamping;
  const auto inverse = InverseOf(H, kMinRcond);
  if (!inverse) return std::nullopt;
  patch.inverse_hessian = *inverse;
  return patch;
}

std::optional<PatchMatch> AlignPatch(const AffinePatch& patch, const ImageF& grey, const PatchPose& start) {
  const int r = patch.radius_px, side = 2 * r + 1;
  const std::size_t padded = patch.value.size();
  PatchMatch match{start, 0};
  std::vector<float> buffer(3 * padded);
  float *seen = buffer.data(), *dx = seen + padded, *dy = dx + padded;
  for (int y = 0, i = 0; y < side; ++y)
    for (int x = 0; x < side; ++x, ++i) dx[i] = static_cast<float>(x - r), dy[i] = static_cast<float>(y - r);
  bool settled = false;
  for (int iteration = 0; iteration <= kMostAlignSteps; ++iteration) {
    PatchPose& pose = match.pose;
    if (!pose.x_px.allFinite() || !pose.A.allFinite() || !Inside(grey, pose, r) || !IsViewOfAPatch(pose.A))
      return std::nullopt;
    SampleUnder(grey, pose, r, padded, dx, dy, seen);
    const double mean = WeightedMean(patch.weight.data(), seen, padded);
    const double deviation = std::sqrt(WeightedSquare(patch.weight.data(), seen, static_cast<float>(mean), padded));
    if (!(deviation > kMinDeviation / 2)) return std::nullopt;
    const Comparison c = Compare(patch.value.data(), patch.weight.data(), patch.steepest.data(), seen,
                                 static_cast<float>(mean), static_cast<float>(1 / deviation), padded);
    match.correlation = c.correlation;
    if (settled) return match;
    if (iteration == kMostAlignSteps) break;
    // The step is a motion of the first patch: its inverse is put before the map (inverse compositional).
    const Vector6d step = patch.inverse_hessian * Eigen::Map<const Vector6d>(c.b.data());
    Eigen::Matrix2d D;
    D << 1 + step[0], step[1], step[2], 1 + step[3];
    if (!(D.determinant() > 0.1)) return std::nullopt;
    pose.A = pose.A * D.inverse();
    const Eigen::Vector2d moved = pose.A * step.tail<2>();
    pose.x_px -= moved;
    if (!((pose.x_px - start.x_px).norm() < kMaxWanderPx)) return std::nullopt;
    settled = moved.norm() < kSettledPx && step.head<4>().norm() * r < 2 * kSettledPx;
  }
  return std::nullopt;
}

}  // namespace lumi
