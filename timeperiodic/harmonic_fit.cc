#include "timeperiodic/harmonic_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "scene/geometry/dense_solvers.h"
#include "timeperiodic/spectrum.h"

namespace lumi {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTwoPi = 6.283185307179586;
constexpr double kGolden = 0.6180339887498949;
// Harmonics that fold back onto each other, or phases that no frame shows: held near 0 by this share of a harmonic's
// own norm.
constexpr double kRidge = 1e-3;
constexpr int kFolds = 5;
constexpr double kBlocks = 15;
constexpr double kSlowTurns = 4;
constexpr double kEssential = 0.02;
constexpr int kPatience = 4;  // rounds without gain before the search ends: a texture may lack middle harmonics
constexpr std::array kHarmonics{1, 2, 3, 4, 6, 8, 12, 16, 24, 32};

MatrixXd Ridged(MatrixXd G, double rows) {
  G.diagonal().array() += kRidge * 0.5 * rows;
  return G;
}

// Coefficients of the fit's derivative by turns of the period: cos -> -h 2 pi sin, sin -> h 2 pi cos.
MatrixXd ByTurns(const MatrixXd& x, int harmonics) {
  MatrixXd slope(x.rows(), x.cols());
  for (Eigen::Index row = 0; row < x.rows(); row += 2) {
    const double w = kTwoPi * static_cast<double>((row / 2) % harmonics + 1);
    slope.row(row) = w * x.row(row + 1);
    slope.row(row + 1) = -w * x.row(row);
  }
  return slope;
}

}  // namespace

HarmonicFit::HarmonicFit(const Signals& signals, bool modulated)
    : signals_(signals), modulated_(modulated && signals.modulation.cols() > 0), total_(signals.values.squaredNorm()) {
  SetTime(signals.time);
}

void HarmonicFit::SetTime(const VectorXd& time) {
  time_ = time;
  span_ = time_.size() > 0 ? time_.maxCoeff() - time_.minCoeff() : 0;
}

MatrixXd HarmonicFit::Basis(double period, int harmonics) const {
  const Eigen::Index n = time_.size();
  // A harmonic that folds back to less than this many turns over the whole video is a trend, whatever it is a harmonic
  // of.
  std::vector<char> slow;
  for (int h = 1; h <= harmonics; ++h) slow.push_back(h / period > kNyquist && Folded(h / period) * span_ < kSlowTurns);
  const Eigen::Index copies = modulated_ ? 1 + signals_.modulation.cols() : 1, plain = 2 * harmonics;
  MatrixXd B(n, plain * copies);
  for (Eigen::Index i = 0; i < n; ++i) {
    // The turn is taken before the sine: exact also where the time is 1e9 periods.
    const double turns = time_[i] / period, angle = kTwoPi * (turns - std::floor(turns));
    const double c1 = std::cos(angle), s1 = std::sin(angle);
    double c = 1, s = 0;
    for (int h = 0; h < harmonics; ++h) {
      const double c_next = c * c1 - s * s1;
      s = s * c1 + c * s1;
      c = c_next;
      const double on = slow[static_cast<std::size_t>(h)] ? 0 : 1;
      B(i, 2 * h) = on * c;
      B(i, 2 * h + 1) = on * s;
    }
  }
  for (Eigen::Index k = 1; k < copies; ++k)
    B.middleCols(k * plain, plain) = signals_.modulation.col(k - 1).asDiagonal() * B.leftCols(plain);
  B -= signals_.nuisance * (signals_.nuisance.transpose() * B);
  return B;
}

double HarmonicFit::Explained(double period, int harmonics) const {
  if (!(total_ > 0)) return 0;
  const MatrixXd B = Basis(period, harmonics);
  const MatrixXd b = B.transpose() * signals_.values;
  const MatrixXd x = SolveSymmetric(Ridged(B.transpose() * B, static_cast<double>(B.rows())), b);
  return (x.array() * b.array()).sum() / total_;
}

CrossValidation HarmonicFit::CrossValidate(double period, int max_harmonics) const {
  return CrossValidate(period, 1, max_harmonics);
}

CrossValidation HarmonicFit::CrossValidate(double period, int first, int last) const {
  CrossValidation best;
  best.explained = -1e9;
  const Eigen::Index n = time_.size();
  const double begin = time_.minCoeff();
  // Whole cycles, and a good part of the video at once: frames that follow each other are alike for other reasons too.
  const double block = period * std::max(1.0, std::ceil(span_ / (kBlocks * period)));
  const int folds = std::clamp(static_cast<int>(span_ / block), 2, kFolds);
  std::vector<std::vector<Eigen::Index>> rows(static_cast<std::size_t>(folds));
  for (Eigen::Index i = 0; i < n; ++i)
    rows[static_cast<std::size_t>(static_cast<long>(std::floor((time_[i] - begin) / block)) % folds)].push_back(i);
  std::vector<std::pair<int, double>> tried;
  int worse = 0;
  for (const int h : kHarmonics) {
    if (h < first) continue;
    if (h > last || (modulated_ ? 2 + 2 * signals_.modulation.cols() : 2) * 2 * h > n || worse == kPatience) break;
    const MatrixXd B = Basis(period, h);
    const MatrixXd G = B.transpose() * B, b = B.transpose() * signals_.values;
    VectorXd error(n);
    for (const auto& fold : rows) {
      if (fold.empty()) continue;
      const MatrixXd Bf = B(fold, Eigen::all), Yf = signals_.values(fold, Eigen::all);
      const MatrixXd x =
          SolveSymmetric(Ridged(G - Bf.transpose() * Bf, static_cast<double>(n - Bf.rows())), b - Bf.transpose() * Yf);
      const VectorXd e = (Yf - Bf * x).rowwise().squaredNorm();
      for (std::size_t k = 0; k < fold.size(); ++k) error[fold[k]] = e[static_cast<Eigen::Index>(k)];
    }
    const double explained = 1 - error.sum() / total_;
    tried.emplace_back(h, explained);
    if (explained > best.explained) {
      best = {explained, h, h, std::move(error)};
      worse = 0;
    } else {
      ++worse;
    }
  }
  for (const auto& [h, explained] : tried)
    if (explained > best.explained - kEssential) {
      best.essential = h;
      break;
    }
  return best;
}

double HarmonicFit::Refine(double start, int harmonics, double reach) const {
  if (!(span_ > 0)) return start;
  const double f0 = 1 / start, width = reach / span_;
  const int steps = std::max(2, static_cast<int>(std::ceil(4 * reach * harmonics)));
  const auto value = [&](double f) { return f > 0 ? Explained(1 / f, harmonics) : -1; };
  double best = f0, best_value = value(f0);
  for (int i = -steps; i <= steps; ++i) {
    const double f = f0 + width * i / steps, v = i == 0 ? best_value : value(f);
    if (v > best_value) best = f, best_value = v;
  }
  double low = best - width / steps, high = best + width / steps;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double va = value(a), vb = value(b);
  while (high - low > 1e-5 / span_ / harmonics) {
    if (va > vb) {
      high = b, b = a, vb = va;
      a = high - kGolden * (high - low), va = value(a);
    } else {
      low = a, a = b, va = vb;
      b = low + kGolden * (high - low), vb = value(b);
    }
  }
  return 2 / (low + high);
}

MatrixXd HarmonicFit::Rest(double period, int harmonics) const {
  const MatrixXd B = Basis(period, harmonics);
  return signals_.values -
         B * SolveSymmetric(Ridged(B.transpose() * B, static_cast<double>(B.rows())), B.transpose() * signals_.values);
}

HarmonicFit::Offsets HarmonicFit::FrameOffsets(double period, int harmonics) const {
  const MatrixXd B = Basis(period, harmonics);
  const MatrixXd x =
      SolveSymmetric(Ridged(B.transpose() * B, static_cast<double>(B.rows())), B.transpose() * signals_.values);
  const MatrixXd rest = signals_.values - B * x, rate = B * ByTurns(x, harmonics) / period;
  Offsets offsets;
  offsets.weight = rate.rowwise().squaredNorm();
  const VectorXd product = (rest.array() * rate.array()).rowwise().sum();
  const double least = 1e-3 * offsets.weight.mean() + 1e-300;
  offsets.lead = product.array() / offsets.weight.array().max(least);
  return offsets;
}

double HarmonicFit::PeriodSigma(double period, int harmonics, Eigen::Index blocks) const {
  const MatrixXd B = Basis(period, harmonics);
  const auto n = static_cast<double>(B.rows());
  const MatrixXd G = Ridged(B.transpose() * B, n);
  const MatrixXd x = SolveSymmetric(G, B.transpose() * signals_.values);
  const MatrixXd rest = signals_.values - B * x;
  // How the fit moves with the frequency, time from the video's middle. What other coefficients do as well tells
  // nothing.
  MatrixXd D = (time_.array() - time_.mean()).matrix().asDiagonal() * (B * ByTurns(x, harmonics));
  D -= signals_.nuisance * (signals_.nuisance.transpose() * D);
  D -= B * SolveSymmetric(G, B.transpose() * D);
  const VectorXd score = (rest.array() * D.array()).rowwise().sum();
  double square = 0;
  for (Eigen::Index k = 0; k < blocks; ++k) {
    const Eigen::Index begin = k * score.size() / blocks, end = (k + 1) * score.size() / blocks;
    const double sum = score.segment(begin, end - begin).sum();
    square += sum * sum;
  }
  const auto m = static_cast<double>(blocks);
  const double told = D.squaredNorm();
  return told > 0 ? period * period * std::sqrt(square * m / (m - 1)) / told : period;
}

}  // namespace lumi
