#include "reconstruct/factorization/linear_program.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>
#include <vector>

namespace lumi {
namespace {

constexpr double kFeasible = 1e-10;

// Rows of A in the order in which they are met; A is row-major with as many numbers a row as c has.
struct BoxedProgram {
  std::vector<double> A, b, c, low, high;
};

bool SolveIncrementally(const BoxedProgram& program, std::vector<double>& x) {
  const auto& [A, b, c, low, high] = program;
  const std::size_t n = b.size(), dim = c.size();
  x.resize(dim);
  for (std::size_t k = 0; k < dim; ++k) x[k] = c[k] < 0 ? low[k] : high[k];
  if (dim == 1) {
    double from = low[0], to = high[0];
    for (std::size_t i = 0; i < n; ++i) {
      if (std::abs(A[i]) < kFeasible) {
        if (b[i] < -kFeasible) return false;
      } else if (A[i] > 0) {
        to = std::min(to, b[i] / A[i]);
      } else {
        from = std::max(from, b[i] / A[i]);
      }
    }
    if (from > to + kFeasible) return false;
    x[0] = c[0] < 0 ? std::min(from, to) : std::max(from, to);
    if (from > to) x[0] = 0.5 * (from + to);
    return true;
  }
  for (std::size_t i = 0; i < n; ++i) {
    const double* a = &A[i * dim];
    double at = -b[i];
    for (std::size_t k = 0; k < dim; ++k) at += a[k] * x[k];
    if (at <= kFeasible) continue;
    // The optimum lies on this constraint: one unknown less.
    std::size_t out = 0;
    for (std::size_t k = 1; k < dim; ++k)
      if (std::abs(a[k]) > std::abs(a[out])) out = k;
    if (std::abs(a[out]) < kFeasible) return false;
    const std::size_t less = dim - 1;
    BoxedProgram reduced{std::vector<double>((i + 2) * less), std::vector<double>(i + 2), std::vector<double>(less),
                         std::vector<double>(less), std::vector<double>(less)};
    auto& [A2, b2, c2, low2, high2] = reduced;
    std::vector<double> x2;
    const double inverse = 1 / a[out];
    const auto reduce = [&](const double* row, double rhs, std::size_t to) {
      const double factor = row[out] * inverse;
      double size = 0;
      for (std::size_t k = 0, j = 0; k < dim; ++k)
        if (k != out) {
          A2[to * (dim - 1) + j] = row[k] - factor * a[k];
          size = std::max(size, std::abs(A2[to * (dim - 1) + j++]));
        }
      b2[to] = rhs - factor * b[i];
      // Nearly parallel to this constraint: what is left is rounding unless scaled up; leave as it is.
      if (size > kFeasible) {
        for (std::size_t j = 0; j + 1 < dim; ++j) A2[to * (dim - 1) + j] /= size;
        b2[to] /= size;
      }
    };
    std::vector<double> unit(dim, 0);
    unit[out] = 1;
    reduce(unit.data(), high[out], 0);
    unit[out] = -1;
    reduce(unit.data(), -low[out], 1);
    for (std::size_t j = 0; j < i; ++j) reduce(&A[j * dim], b[j], j + 2);
    for (std::size_t k = 0, j = 0; k < dim; ++k)
      if (k != out) {
        c2[j] = c[k] - c[out] * inverse * a[k];
        low2[j] = low[k];
        high2[j++] = high[k];
      }
    if (!SolveIncrementally(reduced, x2)) return false;
    double rest = b[i];
    for (std::size_t k = 0, j = 0; k < dim; ++k)
      if (k != out) {
        x[k] = x2[j++];
        rest -= a[k] * x[k];
      }
    x[out] = rest * inverse;
  }
  return true;
}

}  // namespace

std::optional<Eigen::VectorXd> SolveLinearProgram(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                                  const Eigen::VectorXd& c, double bound, std::uint64_t seed) {
  const auto d = static_cast<std::size_t>(c.size());
  if (d < 1 || d > 8 || A.cols() != c.size() || A.rows() != b.size())
    throw std::invalid_argument("SolveLinearProgram: shapes");
  std::vector<std::size_t> order(static_cast<std::size_t>(b.size()));
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::mt19937_64 random(seed);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random() % i]);
  BoxedProgram program{std::vector<double>(order.size() * d),
                       std::vector<double>(order.size()),
                       {c.data(), c.data() + c.size()},
                       std::vector<double>(d, -bound),
                       std::vector<double>(d, bound)};
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto from = static_cast<Eigen::Index>(order[i]);
    program.b[i] = b[from];
    for (std::size_t k = 0; k < d; ++k) program.A[i * d + k] = A(from, static_cast<Eigen::Index>(k));
  }
  std::vector<double> x;
  if (!SolveIncrementally(program, x)) return std::nullopt;
  return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(d));
}

}  // namespace lumi
