#include "render/radiance/optimum/optimum.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>

#include "render/radiance/correlation.h"
#include "render/radiance/dissimilarity.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/kernel.h"
#include "render/radiance/measures/evaluate.h"
#include "render/radiance/measures/own_ray.h"
#include "render/radiance/optimum/coherent_order.h"
#include "render/radiance/optimum/dense_solver.h"
#include "render/radiance/optimum/duplicates.h"
#include "render/radiance/optimum/lane_solver.h"
#include "render/radiance/optimum/sum_to_one.h"
#include "scene/program/registers.h"

namespace lumi {
namespace {

// Conjugate gradients stop where the residual is this part of the wanted accuracy: S's smallest eigenvalue is 0.3 and
// more wherever they are used for long, and the errors of many weights are less than their norm.
constexpr double kResidual = 0.2;
// A photo fades over the last part of the cutoff, so that its weight is 0 where it enters.
constexpr double kCutoffFeather = 0.1;

// The factor of each photo in S and y from its measures; `any` gathers the largest over several rays. f is left as f v.
LUMI_KERNEL void Factors(const float* __restrict theta, float* __restrict f, const float* __restrict v,
                         const float* __restrict enabled, int n, float cutoff, float inverse_feather, bool additive,
                         float* __restrict factor, float* __restrict any) {
  if (v)
    for (int j = 0; j < n; ++j) f[j] *= VisibilityNearOwnRay(v[j], theta[j]);
  for (int j = 0; j < n; ++j) {
    const float taper = inverse_feather > 0 ? RaisedCosine((cutoff - theta[j]) * inverse_feather) : 1.0F;
    const float out = taper * (additive ? enabled[j] : f[j]);
    factor[j] = out;
    any[j] = std::max(any[j], out);
  }
}

// The terms of h beside the angle, each in units of 2 r_max: what the view itself has, and (Channel) what each photo
// has.
struct Channels {
  int count = 0;
  float desired[kMaxChannels] = {};
};

Channels ChannelsOf(const RadianceSettings& s) {
  Channels c;
  ForEachTerm([&]<typename M> {
    if (M::Factor(s) > 0) c.desired[c.count++] = static_cast<float>(M::Factor(s) * M::kOwn);
  });
  if (s.combine == Combine::kAdditive && s.gamma > 0) c.desired[c.count++] = static_cast<float>(s.gamma);
  return c;
}

// One ray of a group, with everything about it that is not a matrix.
struct Ray {
  std::uint32_t index = 0;
  Eigen::Vector3f direction, normal;
  float t = 0;
  Measures measures;
  std::vector<float> factor;  // of each photo: f v and the cutoff's taper
  WeightedPhotos mean;        // the real-time weights
  float alpha = 0;
};

class Optimum {
 public:
  Optimum(const ViewSetup& setup, const VisibilityMaps* maps, const RaySamples& rays, OptimumCounts& counts)
      : setup_(setup),
        sources_(setup.sources),
        settings_(setup.settings),
        maps_(maps && !maps->empty() ? maps : nullptr),
        rays_(rays),
        counts_(counts),
        channels_(ChannelsOf(setup.settings)),
        leaves_(setup.settings.r_min_rad, setup.settings.r_max_rad),
        groups_(GroupByCentre(setup.sources, channels_.count > 0 || setup.settings.combine == Combine::kAdditive ||
                                                 setup.settings.noise > 0)),
        additive_(setup.settings.combine == Combine::kAdditive),
        want_z_(setup.settings.sum == WeightSum::kConstrained) {
    any_.resize(static_cast<std::size_t>(sources_.padded));
    slot_.assign(static_cast<std::size_t>(sources_.count), -1);
    local_.assign(static_cast<std::size_t>(groups_.count()), -1);
    row_.resize(rays.size());
    alpha_.assign(rays.size(), 0.0F);
  }

  void Run(LaneWidth width) {
    const double accuracy = settings_.accuracy;
    std::optional<LeavesFit<float>> single;
    std::optional<LeavesFit<double>> precise;
    if (leaves_.r_min_rad() > 0) {
      if (accuracy >= kFloatAccuracy) single.emplace(leaves_, settings_.alpha);
      if (accuracy >= kLaneAccuracy && !(single && single->usable)) precise.emplace(leaves_, settings_.alpha);
    }
    if (single && single->usable)
      RunLanes(*single, width);
    else if (precise && precise->usable)
      RunLanes(*precise, width);
    else
      RunDense();
  }

  // Rows in the rays' own order.
  void Fill(WeightTable& table) const {
    table.first.assign(rays_.size() + 1, 0);
    table.alpha = alpha_;
    for (std::size_t i = 0; i < rays_.size(); ++i) table.first[i + 1] = table.first[i] + row_[i].count;
    const auto total = static_cast<std::size_t>(table.first.back());
    table.camera.resize(total);
    table.weight.resize(total);
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      std::copy_n(camera_.begin() + static_cast<std::ptrdiff_t>(row_[i].first), row_[i].count,
                  table.camera.begin() + table.first[i]);
      std::copy_n(weight_.begin() + static_cast<std::ptrdiff_t>(row_[i].first), row_[i].count,
                  table.weight.begin() + table.first[i]);
    }
  }

 private:
  struct Row {
    std::size_t first = 0;
    std::int32_t count = 0;
  };

  // Measures, factors and the real-time weights of the ray. false: a hole.
  bool Begin(std::uint32_t index, Ray& ray) {
    ray.index = index;
    ray.direction = rays_.direction[index];
    ray.t = rays_.t[index];
    ray.normal = index < rays_.normal.size() ? rays_.normal[index] : Eigen::Vector3f::Zero();
    ray.mean.camera.clear();
    ray.mean.weight.clear();
    ray.alpha = WeighRay({sources_, maps_, settings_}, {ray.direction, ray.t, ray.normal}, scratch_, ray.mean);
    if (!(ray.alpha > 0)) return false;
    alpha_[index] = ray.alpha;
    EvaluateMeasures(sources_, settings_, ray.direction, ray.t, ray.normal, ray.measures);
    if (maps_) EvaluateVisibility(sources_, maps_, ray.direction, ray.t, ray.measures);
    ray.factor.resize(static_cast<std::size_t>(sources_.padded));
    const bool cut = settings_.cutoff_rad < std::numbers::pi;
    Factors(ray.measures.theta.data(), ray.measures.f.data(), maps_ ? ray.measures.v.data() : nullptr,
            sources_.enabled.data(), sources_.padded, static_cast<float>(settings_.cutoff_rad),
            cut ? static_cast<float>(1 / (kCutoffFeather * settings_.cutoff_rad)) : 0.0F, additive_, ray.factor.data(),
            any_.data());
    ++counts_.samples;
    return true;
  }

  // The groups of photos that some ray since the last call has a factor for.
  void Choose() {
    chosen_.clear();
    for (std::size_t j = 0; j < static_cast<std::size_t>(sources_.count); ++j)
      if (any_[j] > 0) {
        const auto g = static_cast<std::size_t>(groups_.group[j]);
        if (local_[g] < 0) {
          local_[g] = 0;
          chosen_.push_back(groups_.group[j]);
        }
      }
    for (const std::int32_t g : chosen_) local_[static_cast<std::size_t>(g)] = -1;
    std::fill(any_.begin(), any_.end(), 0.0F);
    for (std::size_t c = 0; c < 3; ++c) centre_[c].clear();
    for (const std::int32_t g : chosen_) {
      const auto j = static_cast<std::size_t>(First(g));
      centre_[0].push_back(sources_.dx[j]);
      centre_[1].push_back(sources_.dy[j]);
      centre_[2].push_back(sources_.dz[j]);
    }
  }

  std::int32_t First(std::int32_t g) const {
    return groups_.member[static_cast<std::size_t>(groups_.first[static_cast<std::size_t>(g)])];
  }
  std::span<const std::int32_t> Members(std::int32_t g) const {
    const auto i = static_cast<std::size_t>(g);
    return std::span(groups_.member)
        .subspan(static_cast<std::size_t>(groups_.first[i]),
                 static_cast<std::size_t>(groups_.first[i + 1] - groups_.first[i]));
  }

  double Factor(const Ray& ray, std::int32_t g) {
    const auto members = Members(g);
    if (members.size() == 1) return static_cast<double>(ray.factor[static_cast<std::size_t>(members[0])]);
    member_f_.clear();
    for (const std::int32_t j : members) member_f_.push_back(ray.factor[static_cast<std::size_t>(j)]);
    return GroupFactor(member_f_.data(), static_cast<int>(member_f_.size()));
  }

  float Channel(const Ray& ray, int channel, std::size_t j) const {
    float value = static_cast<float>(settings_.gamma) * ray.measures.f[j];  // Eq. 4.7's, the last
    int at = 0;
    ForEachTerm([&]<typename M> {
      if (M::Factor(settings_) > 0 && at++ == channel)
        value = static_cast<float>(M::Factor(settings_)) * ray.measures.Of<M>()[j];
    });
    return value;
  }

  template <class T>
  void RunLanes(const LeavesFit<T>& fit, LaneWidth width) {
    switch (width) {
      case LaneWidth::k64: return RunLanes<64>(fit);
      case LaneWidth::k32: return RunLanes<32>(fit);
      case LaneWidth::k16: return RunLanes<16>(fit);
    }
  }

  template <int kBytes, class T>
  void RunLanes(const LeavesFit<T>& fit) {
    constexpr std::size_t kRays = static_cast<std::size_t>(kLaneCount<T, kBytes>);
    LaneSystem<T, kBytes> system;
    std::array<Ray, kRays> ray;
    const std::vector<std::uint32_t> order = CoherentOrder(rays_, kRays);
    const auto tolerance = static_cast<T>(kResidual * settings_.accuracy);
    T desired[kMaxChannels];
    std::copy_n(channels_.desired, kMaxChannels, desired);
    for (std::size_t at = 0; at < order.size(); at += kRays) {
      std::size_t lanes = 0;
      for (std::size_t i = at; i < std::min(at + kRays, order.size()); ++i)
        if (Begin(order[i], ray[lanes])) ++lanes;
      if (lanes == 0) continue;
      Choose();
      const std::size_t n = chosen_.size();
      system.Resize(static_cast<int>(n), channels_.count);
      system.diagonal = static_cast<T>(1 + settings_.noise);
      LanePoints<T, kBytes> p;
      for (std::size_t l = 0; l < kRays; ++l) {
        const Ray& from = ray[std::min(l, lanes - 1)];
        for (std::size_t c = 0; c < 3; ++c)
          p[c][l] = static_cast<T>(from.t) * static_cast<T>(from.direction[static_cast<Eigen::Index>(c)]);
      }
      for (std::size_t i = 0; i < n; ++i) {
        const auto j = static_cast<std::size_t>(First(chosen_[i]));
        Lanes<T, kBytes> f{}, theta{};
        for (std::size_t l = 0; l < lanes; ++l) {
          f[l] = static_cast<T>(Factor(ray[l], chosen_[i]));
          theta[l] = static_cast<T>(ray[l].measures.theta[j]);
        }
        system.f[i].v = f;
        system.y[i].v = theta;
        for (int c = 0; c < channels_.count; ++c) {
          Lanes<T, kBytes> e{};
          for (std::size_t l = 0; l < lanes; ++l) e[l] = static_cast<T>(Channel(ray[l], c, j));
          system.channel[c][i].v = e;
        }
      }
      Place(fit, {centre_[0].data(), centre_[1].data(), centre_[2].data()}, p, desired, system);
      Solve(fit, tolerance, want_z_, system);
      for (std::size_t l = 0; l < lanes; ++l) {
        if (!system.solved[l]) {
          ++counts_.dense;
          Dense(ray[l]);
          continue;
        }
        group_w_.resize(n);
        group_z_.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
          group_w_[i] = static_cast<double>(system.w[i].v[l]);
          if (want_z_) group_z_[i] = static_cast<double>(system.z[i].v[l]);
          if (system.y[i].v[l] > 0) counts_.cameras += static_cast<long>(Members(chosen_[i]).size());
        }
        Finish(ray[l]);
      }
    }
  }

  void RunDense() {
    Ray ray;
    for (std::uint32_t i = 0; i < rays_.size(); ++i) {
      if (!(rays_.t[i] > 0) || !std::isfinite(rays_.t[i]) || !Begin(i, ray)) continue;
      Choose();
      for (const double w : Dense(ray)) counts_.cameras += w > 0;
    }
  }

  // Over the chosen groups; returns the right-hand side.
  const Eigen::VectorXd& Dense(const Ray& ray) {
    const auto n = static_cast<Eigen::Index>(chosen_.size());
    const Eigen::Vector3d p = static_cast<double>(ray.t) * ray.direction.cast<double>(), back = -p.normalized();
    dense_.u.resize(3, n);
    dense_.f.resize(n);
    dense_.y.resize(n);
    dense_.channel.resize(n, channels_.count);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const auto j = static_cast<std::size_t>(First(chosen_[k]));
      const Eigen::Vector3d to = Eigen::Vector3d(static_cast<double>(centre_[0][k]), static_cast<double>(centre_[1][k]),
                                                 static_cast<double>(centre_[2][k])) -
                                 p;
      const double length = to.norm();
      const Eigen::Vector3d u = length > 0 ? Eigen::Vector3d(to / length) : Eigen::Vector3d(back);
      dense_.u.col(i) = u;
      dense_.f[i] = Factor(ray, chosen_[k]);
      double h = settings_.alpha * 2 * std::atan2((u - back).norm(), (u + back).norm());
      for (int c = 0; c < channels_.count; ++c) {
        dense_.channel(i, c) = static_cast<double>(Channel(ray, c, j));
        h = WithTerm(h, 2 * leaves_.r_max_rad(), static_cast<double>(channels_.desired[c]), dense_.channel(i, c));
      }
      dense_.y[i] = dense_.f[i] * leaves_.PSame(h);
    }
    Eigen::MatrixXd S = SimilarityMatrix(leaves_, settings_.alpha, dense_);
    S.diagonal().array() += settings_.noise;
    const DenseResult r = SolveDense(S, dense_.y, dense_.f, want_z_);
    counts_.nugget_raised += !r.clipped && r.nugget > 1.5 * kNugget;
    counts_.indefinite += r.clipped;
    group_w_.assign(r.w.begin(), r.w.end());
    if (want_z_) group_z_.assign(r.z.begin(), r.z.end());
    Finish(ray);
    return dense_.y;
  }

  // From the groups' weights to the photos', with sum 1; appends the ray's row.
  void Finish(const Ray& ray) {
    row_camera_.clear();
    row_w_.clear();
    row_z_.clear();
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      const auto members = Members(chosen_[i]);
      if (members.size() == 1) {
        if (group_w_[i] == 0 && (!want_z_ || group_z_[i] == 0)) continue;
        row_camera_.push_back(members[0]);
        row_w_.push_back(group_w_[i]);
        if (want_z_) row_z_.push_back(group_z_[i]);
        continue;
      }
      member_f_.clear();
      for (const std::int32_t j : members) member_f_.push_back(ray.factor[static_cast<std::size_t>(j)]);
      share_.resize(members.size());
      MemberShares(member_f_.data(), static_cast<int>(members.size()), share_.data());
      for (std::size_t m = 0; m < members.size(); ++m) {
        row_camera_.push_back(members[m]);
        row_w_.push_back(share_[m] * group_w_[i]);
        if (want_z_) row_z_.push_back(share_[m] * group_z_[i]);
      }
    }
    double sum = 0;
    const double mean = SumToOne(settings_.sum, row_w_, row_z_, sum);
    counts_.small_sums += sum < kSmallSum;
    if (mean != 0) {
      for (std::size_t i = 0; i < row_camera_.size(); ++i)
        slot_[static_cast<std::size_t>(row_camera_[i])] = static_cast<std::int32_t>(i);
      for (std::size_t i = 0; i < ray.mean.camera.size(); ++i) {
        const double w = mean * static_cast<double>(ray.mean.weight[i]);
        if (const std::int32_t s = slot_[static_cast<std::size_t>(ray.mean.camera[i])]; s >= 0) {
          row_w_[static_cast<std::size_t>(s)] += w;
        } else {
          row_camera_.push_back(ray.mean.camera[i]);
          row_w_.push_back(w);
        }
      }
      for (const std::int32_t j : row_camera_) slot_[static_cast<std::size_t>(j)] = -1;
    }
    Row& row = row_[ray.index];
    row.first = camera_.size();
    for (std::size_t i = 0; i < row_camera_.size(); ++i)
      if (row_w_[i] != 0) {
        camera_.push_back(row_camera_[i]);
        weight_.push_back(static_cast<float>(row_w_[i]));
      }
    row.count = static_cast<std::int32_t>(camera_.size() - row.first);
  }

  const ViewSetup& setup_;
  const RelativeSources& sources_;
  const RadianceSettings& settings_;
  const VisibilityMaps* maps_;
  const RaySamples& rays_;
  OptimumCounts& counts_;
  const Channels channels_;
  const FallingLeaves leaves_;
  const PhotoGroups groups_;
  const bool additive_, want_z_;

  // Of the group at hand.
  std::vector<float> any_;
  std::vector<std::int32_t> chosen_, local_;
  std::vector<float> centre_[3];
  // Of the ray at hand.
  WeighScratch scratch_;
  std::vector<float> member_f_;
  std::vector<double> share_, group_w_, group_z_, row_w_, row_z_;
  std::vector<std::int32_t> row_camera_, slot_;
  DenseSystem dense_;

  std::vector<Row> row_;
  std::vector<float> alpha_;
  std::vector<std::int32_t> camera_;
  std::vector<float> weight_;
};

}  // namespace

std::span<const LaneWidth> LaneWidths() {
  static constexpr LaneWidth kWidths[] = {LaneWidth::k64, LaneWidth::k32, LaneWidth::k16};
  const std::size_t narrower = WidestRegister() == 64 ? 0 : WidestRegister() == 32 ? 1 : 2;
  return std::span(kWidths).subspan(narrower);
}

OptimumCounts& OptimumCounts::operator+=(const OptimumCounts& o) {
  samples += o.samples;
  cameras += o.cameras;
  dense += o.dense;
  nugget_raised += o.nugget_raised;
  indefinite += o.indefinite;
  small_sums += o.small_sums;
  return *this;
}

void WeighOptimal(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                  OptimumCounts& counts) {
  WeighOptimal(setup, visibility, rays, table, counts, LaneWidths().front());
}

void WeighOptimal(const ViewSetup& setup, const VisibilityMaps* visibility, const RaySamples& rays, WeightTable& table,
                  OptimumCounts& counts, LaneWidth width) {
  Optimum optimum(setup, visibility, rays, counts);
  optimum.Run(width);
  optimum.Fill(table);
}

}  // namespace lumi
