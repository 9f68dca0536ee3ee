#include "scene/tracks/vlad.h"

#include <algorithm>
#include <numeric>
#include <opencv2/core.hpp>

#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
constexpr float kByteScale = 1.0F / 512;
// Photos that are loaded at once, and that a product of matrices is formed of: fixed, so that sums do not depend on how
// many threads share the work.
constexpr std::size_t kPhotosAtOnce = 64;

Rows AsFloats(const ByteDescriptors& bytes) { return bytes.cast<float>() * kByteScale; }

// Shape (words, 128).
Rows FindWords(std::size_t photos, const std::function<ByteDescriptors(std::size_t)>& descriptors,
               const VladOptions& options) {
  const auto share = std::max<Eigen::Index>(1, options.sample / static_cast<Eigen::Index>(photos));
  std::vector<float> sample;
  for (std::size_t i = 0; i < photos; ++i) {
    CheckInterrupted();
    const ByteDescriptors d = descriptors(i);
    const Eigen::Index n = std::min<Eigen::Index>(d.rows(), options.most), taken = std::min(n, share);
    for (Eigen::Index k = 0; k < taken; ++k)
      for (int c = 0; c < kByteDescriptorLength; ++c)
        sample.push_back(static_cast<float>(d(k * n / taken, c)) * kByteScale);
  }
  const auto rows = static_cast<int>(sample.size() / kByteDescriptorLength);
  // A word that is the mean of few descriptors is nearly equal to them, so that their differences from it say nothing.
  constexpr int kDescriptorsAWord = 30;
  const int words = rows == 0 ? 0 : std::clamp(rows / kDescriptorsAWord, 1, options.words);
  Rows centres(words, kByteDescriptorLength);
  if (words == 0) return centres;
  const cv::Mat data(rows, kByteDescriptorLength, CV_32F, sample.data());
  cv::Mat labels, found;
  cv::setRNGSeed(static_cast<int>(options.seed % 1000000007));
  constexpr int kIterations = 15;
  cv::kmeans(data, words, labels, cv::TermCriteria(cv::TermCriteria::COUNT, kIterations, 0), 1, cv::KMEANS_PP_CENTERS,
             found);
  for (int w = 0; w < words; ++w)
    centres.row(w) = Eigen::Map<const Eigen::RowVectorXf>(found.ptr<float>(w), kByteDescriptorLength);
  return centres;
}

Eigen::VectorXf Describe(const ByteDescriptors& bytes, const Rows& words, const VladOptions& options) {
  const Rows d = AsFloats(bytes.topRows(std::min<Eigen::Index>(bytes.rows(), options.most)));
  Rows sums = Rows::Zero(words.rows(), kByteDescriptorLength);
  // The nearest word is the one with the largest d . w - |w|^2 / 2.
  const Rows products = (d * words.transpose()).rowwise() - 0.5F * words.rowwise().squaredNorm().transpose();
  for (Eigen::Index i = 0; i < d.rows(); ++i) {
    Eigen::Index nearest = 0;
    products.row(i).maxCoeff(&nearest);
    sums.row(nearest) += d.row(i) - words.row(nearest);
  }
  for (Eigen::Index w = 0; w < sums.rows(); ++w)
    if (const float length = sums.row(w).norm(); length > 0) sums.row(w) /= length;
  Eigen::VectorXf vector = Eigen::Map<const Eigen::VectorXf>(sums.data(), sums.size());
  // Descriptors that are all the same differ by nothing: such photos look alike.
  const float length = vector.norm();
  return length > 0 ? (vector / length).eval() : Eigen::VectorXf::Unit(vector.size(), 0).eval();
}

}  // namespace

Eigen::MatrixXf DescribePhotos(std::size_t photos, const std::function<ByteDescriptors(std::size_t)>& descriptors,
                               const VladOptions& options) {
  if (photos == 0) return {};
  const Rows words = FindWords(photos, descriptors, options);
  Eigen::MatrixXf vectors = Eigen::MatrixXf::Zero(words.size(), static_cast<Eigen::Index>(photos));
  if (words.rows() == 0) return vectors;
  for (std::size_t first = 0; first < photos; first += kPhotosAtOnce) {
    std::vector<ByteDescriptors> block;
    for (std::size_t i = first; i < std::min(photos, first + kPhotosAtOnce); ++i) block.push_back(descriptors(i));
    ParallelEach(block.size(), 1, [&](std::size_t i) {
      if (block[i].rows() > 0) vectors.col(static_cast<Eigen::Index>(first + i)) = Describe(block[i], words, options);
    });
  }
  return vectors;
}

std::vector<std::vector<int>> MostSimilar(const Eigen::MatrixXf& photos, int most, const SimilarPhotos& choice) {
  const Eigen::Index n = photos.cols();
  std::vector<int> of = choice.of.value_or(std::vector<int>());
  if (!choice.of) {
    of.resize(static_cast<std::size_t>(n));
    std::iota(of.begin(), of.end(), 0);
  }
  std::vector<std::vector<int>> similar(of.size());
  const Eigen::VectorXf lengths = photos.colwise().squaredNorm();
  const auto blocks = (of.size() + kPhotosAtOnce - 1) / kPhotosAtOnce;
  ParallelEach(blocks, 1, [&](std::size_t b) {
    const std::size_t first = b * kPhotosAtOnce, count = std::min(kPhotosAtOnce, of.size() - first);
    Eigen::MatrixXf these(photos.rows(), static_cast<Eigen::Index>(count));
    for (std::size_t i = 0; i < count; ++i) these.col(static_cast<Eigen::Index>(i)) = photos.col(of[first + i]);
    const Eigen::MatrixXf products = photos.transpose() * these;
    std::vector<int> others;
    for (std::size_t k = 0; k < count; ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      const int self = of[first + k];
      others.clear();
      for (int j = 0; lengths[self] > 0 && j < n; ++j)
        if (j != self && lengths[j] > 0 && (!choice.may || choice.may(self, j))) others.push_back(j);
      const auto end = others.begin() + std::min<std::ptrdiff_t>(most, std::ssize(others));
      // Of equal ones the first.
      std::partial_sort(others.begin(), end, others.end(), [&](int x, int y) {
        return products(x, i) != products(y, i) ? products(x, i) > products(y, i) : x < y;
      });
      similar[first + k].assign(others.begin(), end);
    }
    if (choice.progress) choice.progress->Step(static_cast<long>(count));
  });
  return similar;
}

}  // namespace lumi
