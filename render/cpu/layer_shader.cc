#include "render/cpu/layer_shader.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "render/radiance/measures/prefilter.h"

namespace lumi {
namespace {

// Below this the upper level's share is under 1/255 of a step: one level serves.
constexpr double kLevelZero = 1.0 / 512;

bool AnyOf16(const float* w) {
  float sum = 0;  // of weights that are never negative
  for (int i = 0; i < 16; ++i) sum += w[i];
  return sum > 0;
}

}  // namespace

bool LinearFromCorners(const std::array<Eigen::Vector2d, 3>& x, Eigen::Matrix3d& out) {
  const Eigen::Vector2d d1 = x[1] - x[0], d2 = x[2] - x[0];
  const double area = d1.x() * d2.y() - d1.y() * d2.x();
  if (!(std::abs(area) > 0)) return false;
  // Barycentric coordinates as functions of (x, y, 1), formed relative to the first corner to keep precision.
  const Eigen::RowVector2d g1(d2.y() / area, -d2.x() / area), g2(-d1.y() / area, d1.x() / area);
  out.row(1) << g1, -g1.dot(x[0]);
  out.row(2) << g2, -g2.dot(x[0]);
  out.row(0) = Eigen::RowVector3d(0, 0, 1) - out.row(1) - out.row(2);
  return out.allFinite();
}

LayerShader::LayerShader(const ViewSetup& setup, const BlendSources& sources)
    : setup_(setup), sources_(sources), maps_(setup) {
  float largest = 1;
  for (const float g : sources.gains) largest = std::max(largest, g);
  weight_one_ = kWeightOne / largest;
  if (setup.settings.similarity == Similarity::kFull) {
    // Positive weights that sum to P are divided by P (1 - kMostTaken) at least.
    weight_one_ *= 1 - kMostTaken;
    lowest_weight_ = -std::numeric_limits<float>::infinity();
  }
}

PhotoLayer LayerShader::Layer(std::size_t photo, const LinearD& inverse_depth,
                              const std::array<Eigen::Vector2d, 3>& corners_px,
                              const Eigen::Matrix3d& linear_from_corners, int x, int y) const {
  PhotoLayer layer;
  layer.photo = photo;
  layer.map = maps_.On(photo, inverse_depth, x, y);
  if (!sources_.photos || !setup_.settings.prefilter) return layer;
  const int last = sources_.photos->count(photo) - 1;
  const double facing = maps_.Facing(photo, inverse_depth);
  Eigen::RowVector3d level;
  double low = last, high = 0;
  for (int i = 0; i < 3; ++i) {
    level[i] = Level(photo, facing, maps_.DepthRatio(photo, inverse_depth, corners_px[static_cast<std::size_t>(i)]));
    low = std::min(low, std::clamp<double>(level[i], 0, last));
    high = std::max(high, std::clamp<double>(level[i], 0, last));
  }
  if (!(high > kLevelZero)) return layer;
  layer.first_level = static_cast<int>(low);
  layer.last_level = static_cast<int>(std::ceil(high));
  layer.level = About(level * linear_from_corners, x, y);
  return layer;
}

double LayerShader::Level(std::size_t photo, double facing_ratio, double depth_ratio) const {
  if (!(depth_ratio > 0)) return 0;
  const double focal_ratio = static_cast<double>(setup_.sources.focal_px[photo] / setup_.focal_px);
  return PyramidLevel(Footprint(focal_ratio, facing_ratio, 1 / depth_ratio)) - sources_.photos->shift(photo);
}

PhotoLayer LayerShader::LayerAtDepths(std::size_t photo, std::span<const SurfacePoint> points, int x, int y) const {
  PhotoLayer layer;
  layer.photo = photo;
  layer.map = maps_.AtDepths(photo, x, y);
  if (!sources_.photos || !setup_.settings.prefilter || points.empty()) return layer;
  const RelativeSources& r = setup_.sources;
  const Eigen::Vector3f centre(r.dx[photo], r.dy[photo], r.dz[photo]),
      axis(r.m[6][photo], r.m[7][photo], r.m[8][photo]);
  const int last = sources_.photos->count(photo) - 1;
  // The mean of the points' logarithms is the logarithm of their footprints' geometric mean.
  const float focal_ratio = r.focal_px[photo] / setup_.focal_px;
  double product = 1;
  int count = 0;
  for (const SurfacePoint& p : points) {
    const Eigen::Vector3f q = p.offset - centre;
    const float depth = axis.dot(q);
    if (!(depth > 0)) continue;
    product *= static_cast<double>(Footprint(focal_ratio, FacingRatio(p.normal.dot(q), p.facing), p.depth / depth));
    ++count;
  }
  if (count == 0) return layer;
  const double mean = 0.5 * std::log2(product) / count + static_cast<double>(kLevelBias);
  const double level = std::clamp<double>(mean - sources_.photos->shift(photo), 0, last);
  if (!(level > kLevelZero)) return layer;
  layer.first_level = static_cast<int>(level);
  layer.last_level = static_cast<int>(std::ceil(level));
  layer.level.c = static_cast<float>(level);
  return layer;
}

void LayerShader::Add(LayerBatch& b, int begin, int end, const PhotoLayer& layer, const float* weight) const {
  if (!sources_.photos) return AddConstant(b, begin, end, weight, (*sources_.colors)[layer.photo].data());
  const float one = sources_.gains.empty() ? weight_one_ : weight_one_ * sources_.gains[layer.photo];
  const float width = setup_.sources.width_px[layer.photo], height = setup_.sources.height_px[layer.photo];
  const auto last = static_cast<float>(sources_.photos->count(layer.photo) - 1);
  alignas(64) float share[kBatch];
  for (int l = layer.first_level; l <= layer.last_level; ++l) {
    const LevelView& level = sources_.photos->level(layer.photo, l);
    const PhotoMap map =
        Scaled(layer.map, static_cast<float>(level.width) / width, static_cast<float>(level.height) / height);
    const float* w = weight;
    if (layer.first_level < layer.last_level) {
      std::copy_n(weight, b.padded(), share);
      ScaleByLevel(b, layer.level, last, static_cast<float>(l), share);
      w = share;
    }
    MapToLevel(b, begin, end, map, level, w, one);
    FetchLayer(b, begin, end, level);
  }
}

// `normalised`: weights sum to 1 up to the integers' rounding, which the division by their own sum undoes.
void LayerShader::Store(LayerBatch& b, bool normalised, float* rgba) const {
  if (!sources_.photos) {
    for (int i = 0; i < b.n; ++i) b.scale[i] = normalised ? b.alpha[i] : 1.0F;
    return StoreConstants(b, rgba);
  }
  if (normalised && sources_.gains.empty())
    ScaleBySum(b);
  else
    for (int i = 0; i < b.n; ++i) b.scale[i] = (normalised ? b.alpha[i] : 1.0F) / (255.0F * weight_one_);
  StoreColors(b, rgba);
}

void LayerShader::Shade(LayerBatch& b, const std::vector<PhotoLayer>& layers, bool sums_to_one,
                        std::vector<float>& scratch, float* rgba) const {
  b.Pad();
  b.Clear(!sources_.photos);
  const int n = b.padded();
  if (sums_to_one) {
    for (const PhotoLayer& layer : layers) {
      EvaluateWeights(b, layer.weight, lowest_weight_, b.weight);
      Add(b, 0, b.n, layer, b.weight);
    }
    std::fill_n(b.alpha, n, 1.0F);
    return Store(b, true, rgba);
  }
  // Each weight is multiplied by its photo's gate and normalised again; with field of view off, the missing share stays
  // missing.
  const bool renormalise = setup_.settings.field_of_view;
  scratch.resize(std::max(scratch.size(), (layers.size() + 2) * kBatch));
  float* total = scratch.data() + layers.size() * kBatch;  // of the positive weights
  float* taken = total + kBatch;                           // by the negative ones
  std::fill_n(total, n, 0.0F);
  std::fill_n(taken, n, 0.0F);
  std::fill_n(b.alpha, n, 0.0F);
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const PhotoLayer& layer = layers[l];
    float* w = scratch.data() + l * kBatch;
    EvaluateWeights(b, layer.weight, lowest_weight_, w);
    if (layer.ends) {
      const RelativeSources& r = setup_.sources;
      const std::size_t j = layer.photo;
      const bool own = r.dx[j] == 0 && r.dy[j] == 0 && r.dz[j] == 0;
      EvaluateGate(b, layer.map, r.width_px[j], r.height_px[j], own || !renormalise ? 0.0F : r.feather_px[j], b.weight);
    } else {
      std::fill_n(b.weight, n, 1.0F);
    }
    for (int i = 0; i < n; ++i) {
      // Alpha follows the best view of the point among the photos that count there.
      b.alpha[i] = std::max(b.alpha[i], w[i] > 0 ? b.weight[i] : 0.0F);
      w[i] *= b.weight[i];
      total[i] += std::max(w[i], 0.0F);
      taken[i] -= std::min(w[i], 0.0F);
    }
  }
  // From here on, `total` and `taken` hold the factors of the positive and of the negative weights.
  for (int i = 0; i < n; ++i) {
    const float most = kMostTaken * total[i], share = taken[i] > most ? most / taken[i] : 1.0F;
    const float left = total[i] - share * taken[i];
    if (!renormalise) b.alpha[i] = std::min(1.0F, left);
    total[i] = !renormalise ? 1 / std::max(1.0F, left) : left > 0 ? 1 / left : 0.0F;
    taken[i] = share * total[i];
  }
  for (std::size_t l = 0; l < layers.size(); ++l) {
    float* w = scratch.data() + l * kBatch;
    for (int i = 0; i < n; ++i) w[i] *= w[i] < 0 ? taken[i] : total[i];
  }
  for (std::size_t l = 0; l < layers.size(); ++l) Add(b, 0, b.n, layers[l], scratch.data() + l * kBatch);
  Store(b, renormalise, rgba);
}

void LayerShader::ShadeWeighted(LayerBatch& b, const std::vector<PhotoLayer>& layers, const std::vector<float>& weights,
                                float* rgba) const {
  b.Clear(!sources_.photos);
  for (std::size_t l = 0; l < layers.size(); ++l) {
    const float* w = weights.data() + l * kBatch;
    // Most candidates count in only a part of the batch: draw runs of 16 pixels in which this one does.
    for (int begin = 0; begin < b.n;) {
      int end = begin;
      while (end < b.n && AnyOf16(w + end)) end += 16;
      if (end > begin) Add(b, begin, std::min(end, b.n), layers[l], w);
      begin = end + 16;
    }
  }
  Store(b, setup_.settings.field_of_view, rgba);
}

}  // namespace lumi
