#include "proxy/dense/patch_match.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>

#include "scene/program/hash_bits.h"
#include "scene/program/kernel.h"
#include "scene/program/parallel_each.h"

namespace lumi {
namespace {

constexpr int kHypotheses = 9;  // the pixel's own and the best of eight regions
// A source matches a hypothesis below the first, which falls with the iterations, and does not above the second.
constexpr float kGoodCost = 0.8F, kBadCost = 1.2F, kGoodFall = 90, kWeightSigma = 0.3F;
constexpr float kChosenBefore = 0.9F, kNotChosenBefore = 0.1F;  // how likely a neighbour's source is one's own
constexpr float kMostOffPx = 3;                                 // beyond, two maps disagree as much as they can
constexpr float kSteepest = 3.7F;                               // a plane's slope, tan of 75 degrees

using Lanes = std::array<float, kLanes>;

// In [-1, 1).
LUMI_INLINE float Signed(std::uint32_t bits) {
  return static_cast<float>(static_cast<std::int32_t>(bits)) / 2147483648.0F;
}

// A source's own map for fetches at random: a pixel's plane in one place, w, gx, gy and nothing.
struct PackedPlanes {
  static constexpr int kNumbers = 4;
  int width = 0, height = 0;
  float of_camera_x = 1, of_camera_y = 1;  // the map's pixels over the camera's
  std::vector<float> planes;
};
PackedPlanes Pack(const DepthMap& map, const StereoCamera& camera) {
  PackedPlanes packed;
  packed.width = map.width;
  packed.height = map.height;
  packed.of_camera_x = static_cast<float>(map.width) / static_cast<float>(camera.width);
  packed.of_camera_y = static_cast<float>(map.height) / static_cast<float>(camera.height);
  packed.planes.resize(PackedPlanes::kNumbers * map.Pixels());
  for (std::size_t p = 0; p < map.Pixels(); ++p) {
    float* plane = packed.planes.data() + PackedPlanes::kNumbers * p;
    plane[0] = map.w[p];
    plane[1] = map.gx[p];
    plane[2] = map.gy[p];
  }
  return packed;
}

// How far, in pixels of the reference, a plane's point lies from what the source's own map puts there; kMostOffPx where
// that has nothing.
LUMI_KERNEL void GeometricErrors(const PatchBatch& at, const PlaneBatch& planes, const PairGeometry& to,
                                 const PairGeometry& back, const PackedPlanes& map, float* __restrict error) {
  const float sx = map.of_camera_x, sy = map.of_camera_y;
  const float* packed = map.planes.data();
  const std::int32_t stride = map.width;
  const float right = static_cast<float>(map.width), bottom = static_cast<float>(map.height);
  for (int l = 0; l < kLanes; ++l) {
    const float x = at.x[l], y = at.y[l], w = planes.w[l];
    const float z = to.a[6] * x + to.a[7] * y + to.a[8] + w * to.b[2], inverse = 1 / z;
    const float u = (to.a[0] * x + to.a[1] * y + to.a[2] + w * to.b[0]) * inverse;
    const float v = (to.a[3] * x + to.a[4] * y + to.a[5] + w * to.b[1]) * inverse;
    // The lower bound is the first argument of max, so that NaN becomes it.
    const float mu = std::min(std::max(0.0F, u * sx), right - 1), mv = std::min(std::max(0.0F, v * sy), bottom - 1);
    const auto i = static_cast<std::int32_t>(mu), j = static_cast<std::int32_t>(mv);
    const std::int32_t m = PackedPlanes::kNumbers * (j * stride + i);
    const float there = packed[m] + packed[m + 1] * (mu - static_cast<float>(i) - 0.5F) +
                        packed[m + 2] * (mv - static_cast<float>(j) - 0.5F);
    const float depth = back.a[6] * u + back.a[7] * v + back.a[8] + there * back.b[2], outward = 1 / depth;
    const float ex = (back.a[0] * u + back.a[1] * v + back.a[2] + there * back.b[0]) * outward - x;
    const float ey = (back.a[3] * u + back.a[4] * v + back.a[5] + there * back.b[1]) * outward - y;
    const float off = std::sqrt(ex * ex + ey * ey);
    const bool seen = (z > 0) & (u >= 0) & (v >= 0) & (u * sx <= right) & (v * sy <= bottom) & (there > 0) &
                      (depth > 0) & (off < kMostOffPx);
    error[l] = seen ? off : kMostOffPx;
  }
}

// Where a region of the checkerboard looks for its best pixel: four near ones and four far ones, all of the other
// colour (their distances are odd).
struct Region {
  int count = 0;
  std::array<std::array<int, 2>, 12> at{};
};
constexpr std::array<Region, 8> kRegions = [] {
  std::array<Region, 8> regions{};
  constexpr int dx[] = {0, 0, -1, 1}, dy[] = {-1, 1, 0, 0};
  for (std::size_t side = 0; side < 4; ++side) {
    const int x = dx[side], y = dy[side];
    Region& near = regions[side];  // a V that opens away from the pixel
    const auto add = [](Region& r, int i, int j) { r.at[static_cast<std::size_t>(r.count++)] = {i, j}; };
    add(near, x, y);
    for (int step = 1; step <= 3; ++step) {
      add(near, (step + 1) * x + step * y, (step + 1) * y + step * x);
      add(near, (step + 1) * x - step * y, (step + 1) * y - step * x);
    }
    Region& far = regions[4 + side];
    for (int step = 3; step <= 23; step += 2) add(far, step * x, step * y);
  }
  return regions;
}();

struct PairsOfViews {
  PairGeometry to, back;
  QuadImage quads;
  PackedPlanes planes;  // where the source has a map
};

class Matcher {
 public:
  Matcher(const StereoPicture& reference, const std::vector<MatchSource>& sources, const PatchMatchOptions& options,
          DepthMap& map)
      : reference_(reference),
        sources_(sources),
        options_(options),
        map_(map),
        total_(map.Pixels()),
        used_(map.Pixels()) {
    pairs_.resize(sources.size());
    ParallelEach(sources.size(), 1, [&](std::size_t s) {
      pairs_[s].to = Pair(reference.camera, sources[s].picture->camera);
      pairs_[s].back = Pair(sources[s].picture->camera, reference.camera);
      pairs_[s].quads = PackQuads(sources[s].picture->grey);
      if (sources[s].map) pairs_[s].planes = Pack(*sources[s].map, sources[s].picture->camera);
    });
    focal_px_ = static_cast<float>(reference.camera.FocalPx());
  }

  void Run() {
    // Costs of where it starts from: both colours are scored before either moves.
    for (int colour = 0; colour < 2; ++colour) Sweep(-1, colour);
    for (int iteration = 0; iteration < options_.iterations; ++iteration)
      for (int colour = 0; colour < 2; ++colour) Sweep(iteration, colour);
    for (std::size_t p = 0; p < map_.Pixels(); ++p)
      if (!reference_.ignored.empty() && reference_.ignored.data[p] > 127) map_.w[p] = 0;
  }

 private:
  // Sixteen pixels of one colour in a row, and what is tried there.
  struct Batch {
    PatchBatch patches;
    std::array<PlaneBatch, kHypotheses> planes;
    std::array<std::array<Lanes, kMostSources>, kHypotheses> cost, off;  // of correlation, of geometry
    std::array<Lanes, kMostSources> prior, weight;                       // of a source
    std::array<bool, kMostSources> counts;                               // for any of the pixels
    Lanes best_total, best_cost;
    PlaneBatch best;
    std::array<int, kLanes> x;
    int lanes = 0, y = 0;
  };

  struct SourceOrder {
    std::array<std::size_t, kMostSources> at;
    std::size_t count = 0;
  };

  void Sweep(int iteration, int colour) {
    ParallelEach(static_cast<std::size_t>(map_.height), 4, [&](std::size_t row) {
      const int y = static_cast<int>(row);
      Batch batch;
      for (int x = (y + colour) & 1; x < map_.width; x += 2 * kLanes) {
        Fill(x, y, batch);
        MakePatches(reference_.grey, batch.x.data(), y, batch.patches, reference_.object);
        if (iteration < 0) {
          ScoreStart(batch);
        } else {
          Gather(batch);
          WeighSources(iteration, batch);
          TakeBest(batch);
          Vary(iteration, batch);
        }
        Keep(batch);
      }
    });
  }

  void Fill(int x, int y, Batch& batch) const {
    batch.y = y;
    batch.lanes = std::min(kLanes, (map_.width - x + 1) / 2);
    for (int l = 0; l < kLanes; ++l) batch.x[static_cast<std::size_t>(l)] = x + 2 * std::min(l, batch.lanes - 1);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::size_t p = map_.At(batch.x[l], y);
      batch.planes[0].w[l] = map_.w[p];
      batch.planes[0].gx[l] = map_.gx[p];
      batch.planes[0].gy[l] = map_.gy[p];
    }
  }

  void Correlate(const Batch& batch, const PlaneBatch& planes, std::size_t s, Lanes& cost) const {
    ScorePatches(batch.patches, pairs_[s].quads, pairs_[s].to, planes, cost.data());
  }

  void Compare(const Batch& batch, const PlaneBatch& planes, std::size_t s, Lanes& off) const {
    if (sources_[s].map)
      GeometricErrors(batch.patches, planes, pairs_[s].to, pairs_[s].back, pairs_[s].planes, off.data());
    else
      off.fill(0);
  }

  void Score(const Batch& batch, const PlaneBatch& planes, std::size_t s, Lanes& cost, Lanes& off) const {
    Correlate(batch, planes, s, cost);
    Compare(batch, planes, s, off);
  }

  // The two best sources say how good a plane to start from is: which ones to trust is not known yet.
  void ScoreStart(Batch& batch) const {
    batch.best = batch.planes[0];
    Lanes first, second, cost, off;
    first.fill(2 * kUnseen);
    second.fill(2 * kUnseen);
    for (std::size_t s = 0; s < sources_.size(); ++s) {
      Score(batch, batch.best, s, cost, off);
      for (std::size_t l = 0; l < kLanes; ++l) {
        const float c = cost[l] + options_.geometric_weight * off[l];
        second[l] = std::min(second[l], std::max(first[l], c));
        first[l] = std::min(first[l], c);
      }
    }
    for (std::size_t l = 0; l < kLanes; ++l) {
      batch.best_total[l] = sources_.size() > 1 ? 0.5F * (first[l] + second[l]) : first[l];
      batch.best_cost[l] = batch.best_total[l];
      for (std::size_t s = 0; s < sources_.size(); ++s) batch.weight[s][l] = 0;
    }
  }

  // The best pixel of each region, its plane carried over to here; where there is none, the pixel's own again.
  void Gather(Batch& batch) const {
    for (std::size_t s = 0; s < sources_.size(); ++s) batch.prior[s].fill(1);
    for (std::size_t region = 0; region < kRegions.size(); ++region) {
      const Region& r = kRegions[region];
      PlaneBatch& planes = batch.planes[1 + region];
      for (std::size_t l = 0; l < kLanes; ++l) {
        float least = std::numeric_limits<float>::infinity();
        int bx = batch.x[l], by = batch.y;
        for (std::size_t k = 0; k < static_cast<std::size_t>(r.count); ++k) {
          const int x = batch.x[l] + r.at[k][0], y = batch.y + r.at[k][1];
          if (x < 0 || y < 0 || x >= map_.width || y >= map_.height) continue;
          const float total = total_[map_.At(x, y)];
          if (total < least) least = total, bx = x, by = y;
        }
        const std::size_t p = map_.At(bx, by);
        const float w = map_.w[p] + map_.gx[p] * static_cast<float>(batch.x[l] - bx) +
                        map_.gy[p] * static_cast<float>(batch.y - by);
        const bool possible = w <= options_.nearest_w && w >= options_.farthest_w;
        planes.w[l] = possible ? w : batch.planes[0].w[l];
        planes.gx[l] = possible ? map_.gx[p] : batch.planes[0].gx[l];
        planes.gy[l] = possible ? map_.gy[p] : batch.planes[0].gy[l];
        if (region >= 4) continue;
        for (std::size_t s = 0; s < sources_.size(); ++s)
          batch.prior[s][l] += (used_[p] >> s) & 1 ? kChosenBefore : kNotChosenBefore;
      }
    }
    for (std::size_t h = 0; h < kHypotheses; ++h)
      for (std::size_t s = 0; s < sources_.size(); ++s)
        Score(batch, batch.planes[h], s, batch.cost[h][s], batch.off[h][s]);
  }

  void WeighSources(int iteration, Batch& batch) const {
    const auto step = static_cast<float>(iteration);
    const float good = kGoodCost * std::exp(-step * step / kGoodFall);
    const float faint = std::exp(-good * good / (2 * kWeightSigma * kWeightSigma));
    Lanes sum;
    sum.fill(0);
    for (std::size_t s = 0; s < sources_.size(); ++s) {
      for (std::size_t l = 0; l < kLanes; ++l) {
        int matches = 0, misses = 0;
        float confidence = 0;
        for (std::size_t h = 0; h < kHypotheses; ++h) {
          const float c = batch.cost[h][s][l];
          if (c < good) {
            ++matches;
            confidence += std::exp(-c * c / (2 * kWeightSigma * kWeightSigma));
          }
          if (c > kBadCost) ++misses;
        }
        float weight = 0;
        if (misses < 3) weight = batch.prior[s][l] * (matches > 2 ? confidence / static_cast<float>(matches) : faint);
        batch.weight[s][l] = weight;
        sum[l] += weight;
      }
    }
    for (std::size_t l = 0; l < kLanes; ++l) {
      if (sum[l] > 0) continue;
      // No source is reliable: the one that matches the pixel's own plane best is taken.
      std::size_t best = 0;
      for (std::size_t s = 1; s < sources_.size(); ++s)
        if (batch.cost[0][s][l] < batch.cost[0][best][l]) best = s;
      batch.weight[best][l] = sum[l] = 1;
    }
    for (std::size_t s = 0; s < sources_.size(); ++s) {
      batch.counts[s] = false;
      for (std::size_t l = 0; l < kLanes; ++l) {
        batch.weight[s][l] /= sum[l];
        if (batch.weight[s][l] > 0) batch.counts[s] = true;
      }
    }
  }

  void TakeBest(Batch& batch) const {
    batch.best_total.fill(std::numeric_limits<float>::infinity());
    for (std::size_t h = 0; h < kHypotheses; ++h) Offer(batch, batch.planes[h], batch.cost[h], batch.off[h]);
  }

  // What a plane costs: sources that count, by their weights.
  Lanes Totals(const Batch& batch, const std::array<Lanes, kMostSources>& cost,
               const std::array<Lanes, kMostSources>& off) const {
    Lanes total;
    total.fill(0);
    for (std::size_t s = 0; s < sources_.size(); ++s) {
      if (!batch.counts[s]) continue;
      for (std::size_t l = 0; l < kLanes; ++l)
        total[l] += batch.weight[s][l] * (cost[s][l] + options_.geometric_weight * off[s][l]);
    }
    return total;
  }

  // Takes a plane where it is better than the best so far: of equals the first stays.
  void Offer(Batch& batch, const PlaneBatch& planes, const std::array<Lanes, kMostSources>& cost,
             const std::array<Lanes, kMostSources>& off) const {
    const Lanes total = Totals(batch, cost, off);
    Lanes photo;
    photo.fill(0);
    for (std::size_t s = 0; s < sources_.size(); ++s) {
      if (!batch.counts[s]) continue;
      for (std::size_t l = 0; l < kLanes; ++l) photo[l] += batch.weight[s][l] * cost[s][l];
    }
    for (std::size_t l = 0; l < kLanes; ++l) {
      if (!(total[l] < batch.best_total[l])) continue;
      batch.best_total[l] = total[l];
      batch.best_cost[l] = photo[l];
      batch.best.w[l] = planes.w[l];
      batch.best.gx[l] = planes.gx[l];
      batch.best.gy[l] = planes.gy[l];
    }
  }

  // Depth and slope moved a little, each alone drawn anew, and both moved less.
  void Vary(int iteration, Batch& batch) const {
    const float reach = options_.perturbation * std::exp2(-static_cast<float>(iteration));
    const float tilt = 0.5F * std::exp2(-static_cast<float>(iteration));
    const float range = options_.nearest_w - options_.farthest_w;
    const SourceOrder order = ByWeight(batch);
    for (std::uint32_t trial = 0; trial < 5; ++trial) {
      PlaneBatch planes;
      for (std::size_t l = 0; l < kLanes; ++l) {
        const auto place = static_cast<std::uint32_t>(map_.At(batch.x[l], batch.y));
        const std::uint32_t bits =
            HashBits(place ^ HashBits(options_.seed + 64 * static_cast<std::uint32_t>(iteration) + trial));
        const float r0 = Signed(bits), r1 = Signed(HashBits(bits + 1)), r2 = Signed(HashBits(bits + 2));
        float w = batch.best.w[l];
        // Slopes, as of a surface: a plane's gradient over its inverse depth, a focal length wide.
        float a = batch.best.gx[l] * focal_px_ / w, b = batch.best.gy[l] * focal_px_ / w;
        if (trial == 0) w *= 1 + reach * r0;
        if (trial == 1) a += tilt * r1, b += tilt * r2;
        if (trial == 2) w = options_.farthest_w + range * 0.5F * (r0 + 1);
        if (trial == 3) a = kSteepest * r1 * std::abs(r1), b = kSteepest * r2 * std::abs(r2);
        if (trial == 4) w *= 1 + 0.25F * reach * r0, a += 0.25F * tilt * r1, b += 0.25F * tilt * r2;
        w = std::clamp(w, options_.farthest_w, options_.nearest_w);
        planes.w[l] = w;
        planes.gx[l] = a * w / focal_px_;
        planes.gy[l] = b * w / focal_px_;
      }
      Try(order, planes, batch);
    }
  }

  // Sources that count, those with the largest weights first.
  SourceOrder ByWeight(const Batch& batch) const {
    SourceOrder order;
    Lanes sums;
    for (std::size_t s = 0; s < sources_.size(); ++s) {
      if (!batch.counts[s]) continue;
      sums[s] = std::accumulate(batch.weight[s].begin(), batch.weight[s].end(), 0.0F);
      order.at[order.count++] = s;
    }
    std::stable_sort(order.at.begin(), order.at.begin() + static_cast<std::ptrdiff_t>(order.count),
                     [&](std::size_t a, std::size_t b) { return sums[a] > sums[b]; });
    return order;
  }

  // Offers a plane. Correlation is nearly all of the time: it is asked for one source after the other, and no further
  // once no pixel can gain. A cost is 0 at least, and sums of floats that grow do not fall: what is chosen stays the
  // same.
  void Try(const SourceOrder& order, const PlaneBatch& planes, Batch& batch) const {
    std::array<Lanes, kMostSources> cost, off;
    for (std::size_t i = 0; i < order.count; ++i) {
      Compare(batch, planes, order.at[i], off[order.at[i]]);
      cost[order.at[i]].fill(0);
    }
    for (std::size_t i = 0; i < order.count; ++i) {
      if (!CanGain(batch, cost, off)) return;
      Correlate(batch, planes, order.at[i], cost[order.at[i]]);
    }
    Offer(batch, planes, cost, off);
  }

  bool CanGain(const Batch& batch, const std::array<Lanes, kMostSources>& cost,
               const std::array<Lanes, kMostSources>& off) const {
    const Lanes total = Totals(batch, cost, off);
    bool any = false;
    for (std::size_t l = 0; l < kLanes; ++l) any |= total[l] < batch.best_total[l];
    return any;
  }

  void Keep(const Batch& batch) {
    for (std::size_t l = 0; l < static_cast<std::size_t>(batch.lanes); ++l) {
      const std::size_t p = map_.At(batch.x[l], batch.y);
      map_.w[p] = batch.best.w[l];
      map_.gx[p] = batch.best.gx[l];
      map_.gy[p] = batch.best.gy[l];
      map_.cost[p] = batch.best_cost[l];
      total_[p] = batch.best_total[l];
      std::uint16_t used = 0;
      for (std::size_t s = 0; s < sources_.size(); ++s)
        if (batch.weight[s][l] * static_cast<float>(sources_.size()) > 0.5F)
          used |= static_cast<std::uint16_t>(1U << s);
      used_[p] = used;
    }
  }

  const StereoPicture& reference_;
  const std::vector<MatchSource>& sources_;
  const PatchMatchOptions& options_;
  DepthMap& map_;
  std::vector<float> total_;         // what a pixel's plane costs, geometry included
  std::vector<std::uint16_t> used_;  // sources that its plane was judged by, a bit each
  std::vector<PairsOfViews> pairs_;
  float focal_px_ = 1;
};

}  // namespace

void MatchPatches(const StereoPicture& reference, const std::vector<MatchSource>& sources,
                  const PatchMatchOptions& options, DepthMap& map) {
  Matcher(reference, sources, options, map).Run();
}

}  // namespace lumi
