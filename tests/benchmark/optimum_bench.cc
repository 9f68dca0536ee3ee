// What the optimum costs, and how exact it is (docs/optimum.md quotes it): the thesis's Example #1 in its proportions,
// 262 photos, a plane for a proxy, 640x480, on two threads. Errors are the largest over a sample's photos, against the
// full system.
//   optimum_bench [--quick | --widths]
// --widths: the narrower registers of other machines only. Measures and the real-time weights are compiled for this one
// all the same.
#include <fmt/format.h>

#include <boost/multiprecision/cpp_dec_float.hpp>
#include <chrono>
#include <ctime>
#include <random>

#include "render/radiance/optimum/coherent_order.h"
#include "render/radiance/optimum/dense_solver.h"
#include "render/radiance/optimum/leaves_fit.h"
#include "render/radiance/optimum/optimum.h"
#include "render/radiance/reconstruct.h"
#include "scene/program/parallel.h"
#include "tests/benchmark/plain_optimum.h"
#include "tests/render/optimum_oracle.h"

namespace lumi::test {
namespace {

using Decimal = boost::multiprecision::number<boost::multiprecision::cpp_dec_float<50>, boost::multiprecision::et_off>;
constexpr int kWidth = 640, kHeight = 480, kTileWidth = 64, kTileHeight = 16;

struct Time {
  double median_ms = 0;
  double cpu_ms =
      0;  // the process's time on its cores, a thread, median: what the wall shows where no one else is at work
};

Time Measure(const std::function<void()>& body, int repeats) {
  std::vector<double> ms, cpu;
  for (int i = 0; i < repeats; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const std::clock_t cpu_start = std::clock();
    body();
    cpu.push_back(1000.0 * static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC / ThreadCount());
    ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  std::sort(ms.begin(), ms.end());
  std::sort(cpu.begin(), cpu.end());
  return {ms[ms.size() / 2], cpu[cpu.size() / 2]};
}

RadianceSettings Settings(double accuracy, double cutoff_deg) {
  RadianceSettings s;
  s.similarity = Similarity::kFull;
  s.correlation = Correlation::kFallingLeaves;
  s.accuracy = accuracy;
  s.cutoff_rad = cutoff_deg * kRadPerDeg;
  return s;
}

// Tiles as the renderer makes them.
std::vector<RaySamples> Tiles(const DeskLike& desk, const ViewSetup& setup) {
  std::vector<RaySamples> tiles;
  for (int y = 0; y < kHeight; y += kTileHeight)
    for (int x = 0; x < kWidth; x += kTileWidth) {
      std::vector<Eigen::Vector2d> pixels;
      for (int v = 0; v < kTileHeight; ++v)
        for (int u = 0; u < kTileWidth; ++u) pixels.emplace_back(x + u + 0.5, y + v + 0.5);
      tiles.push_back(RaysThrough(desk, setup, pixels));
    }
  return tiles;
}

OptimumCounts WeighAllTiles(const ViewSetup& setup, const std::vector<RaySamples>& tiles,
                            LaneWidth width = LaneWidths().front()) {
  std::vector<OptimumCounts> counts(tiles.size());
  ParallelFor(tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    WeightTable table;
    for (std::size_t i = begin; i < end; ++i) WeighOptimal(setup, nullptr, tiles[i], table, counts[i], width);
  });
  OptimumCounts sum;
  for (const OptimumCounts& c : counts) sum += c;
  return sum;
}

struct Errors {
  double largest = 0, median = 0;
};

// Oracles are made once, for one sum.
template <class Real>
struct Truth {
  std::vector<OracleWeights<Real>> samples;
  double correlated = 0;
};

template <class Real>
Truth<Real> MakeTruth(const ViewSetup& setup, const RaySamples& rays, std::size_t count) {
  const OracleLeaves<Real> leaves(Real(setup.settings.r_min_rad), Real(setup.settings.r_max_rad));
  Truth<Real> truth;
  truth.samples.resize(count);
  ParallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      truth.samples[i] = OracleOptimum<Real>(setup, nullptr, rays.direction[i], rays.t[i], leaves);
  });
  for (const auto& s : truth.samples) truth.correlated += s.correlated / static_cast<double>(count);
  return truth;
}

template <class Real>
Errors Compare(const WeightTable& table, const Truth<Real>& truth) {
  std::vector<double> e;
  for (std::size_t i = 0; i < truth.samples.size(); ++i) e.push_back(LargestError(table, i, truth.samples[i]));
  std::sort(e.begin(), e.end());
  return {e.back(), e[e.size() / 2]};
}

// What the estimator is without any of this (plain_optimum.h), with the same instructions.
Time PlainTime(const ViewSetup& setup, const RaySamples& rays, std::size_t count) {
  const FallingLeaves leaves(setup.settings.r_min_rad, setup.settings.r_max_rad);
  double checksum = 0;
  const Time time = Measure(
      [&] {
        std::vector<double> sums(count);
        ParallelFor(count, 1, [&](std::size_t begin, std::size_t end) {
          Measures m;
          for (std::size_t i = begin; i < end; ++i) {
            EvaluateMeasures(setup.sources, setup.settings, rays.direction[i], rays.t[i], Eigen::Vector3f::Zero(), m);
            PlainSample sample{setup.sources.count,
                               setup.sources.dx.data(),
                               setup.sources.dy.data(),
                               setup.sources.dz.data(),
                               m.f.data(),
                               m.theta.data(),
                               {},
                               kNugget};
            const Eigen::Vector3d p = static_cast<double>(rays.t[i]) * rays.direction[i].cast<double>();
            std::copy(p.begin(), p.end(), sample.point);
            sums[i] = SolvePlainly(sample, leaves);
          }
        });
        for (const double s : sums) checksum += s;
      },
      3);
  if (!std::isfinite(checksum)) fmt::print("not finite\n");
  return {time.median_ms / static_cast<double>(count), time.cpu_ms / static_cast<double>(count)};
}

struct Speed {
  Time frame, sparse;  // 640x480; 25x25
};

Speed MeasureSpeed(const DeskLike& desk, const ViewSetup& setup, int frames, int grids, LaneWidth width) {
  const std::vector<RaySamples> tiles = Tiles(desk, setup);
  std::vector<Eigen::Vector2d> grid;
  for (int y = 0; y < 25; ++y)
    for (int x = 0; x < 25; ++x) grid.emplace_back((x + 0.0) * kWidth / 24, (y + 0.0) * kHeight / 24);
  const RaySamples on_grid = RaysThrough(desk, setup, grid);
  // Cells of the k-d tree for the threads, as a planner of sparse samples would cut them.
  const std::vector<std::uint32_t> order = CoherentOrder(on_grid, 16);
  std::vector<RaySamples> parts;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i % 80 == 0) parts.emplace_back();
    parts.back().direction.push_back(on_grid.direction[order[i]]);
    parts.back().t.push_back(on_grid.t[order[i]]);
  }
  return {Measure([&] { WeighAllTiles(setup, tiles, width); }, frames),
          Measure([&] { WeighAllTiles(setup, parts, width); }, grids)};
}

std::vector<Eigen::Vector2d> RandomPixels(std::size_t count) {
  std::mt19937 engine(7);
  std::uniform_real_distribution<double> ux(0, kWidth), uy(0, kHeight);
  std::vector<Eigen::Vector2d> pixels;
  while (pixels.size() < count) pixels.emplace_back(ux(engine), uy(engine));
  return pixels;
}

void Widths() {
  SetThreadCount(2);
  const DeskLike desk = MakeDeskLike();
  constexpr std::size_t kSamples = 40;
  fmt::print(
      "\n## The optimum in narrower registers\n\nThe process's time on its cores, a thread.\n\n| `--accuracy` | "
      "`--cutoff-deg` | registers, bytes | largest error | 640x480 s | 25x25 ms |\n|---|---|---|---|---|---|\n");
  Truth<long double> truth;
  for (const auto& [accuracy, cutoff] : std::vector<std::pair<double, double>>{{1e-3, 20.0}, {1e-6, 28.0}}) {
    const ViewSetup setup = MakeViewSetup(desk.sources, desk.view, Settings(accuracy, cutoff));
    const RaySamples random = RaysThrough(desk, setup, RandomPixels(kSamples));
    if (truth.samples.empty()) truth = MakeTruth<long double>(setup, random, kSamples);
    for (const LaneWidth width : LaneWidths()) {
      WeightTable table;
      OptimumCounts counts;
      WeighOptimal(setup, nullptr, random, table, counts, width);
      const Speed speed = MeasureSpeed(desk, setup, 1, 21, width);
      fmt::print("| {:g} | {:g} | {} | {:.1e} | {:.2f} | {:.1f} |\n", accuracy, cutoff, static_cast<int>(width),
                 Compare(table, truth).largest, speed.frame.cpu_ms / 1000, speed.sparse.cpu_ms);
    }
  }
}

void Main(bool quick) {
  SetThreadCount(2);
  const DeskLike desk = MakeDeskLike();
  const auto setup_for = [&](const RadianceSettings& s) { return MakeViewSetup(desk.sources, desk.view, s); };
  const ViewSetup base = setup_for(Settings(1e-3, 20));

  const std::size_t samples = quick ? 200 : 1000, decimal_samples = quick ? 6 : 60;
  const std::vector<Eigen::Vector2d> pixels = RandomPixels(samples);
  const RaySamples random = RaysThrough(desk, base, pixels);

  SetThreadCount(0);
  auto truth = MakeTruth<long double>(base, random, samples);
  const auto decimal = MakeTruth<Decimal>(base, random, decimal_samples);
  SetThreadCount(2);
  double worst = 0;
  for (std::size_t i = 0; i < decimal_samples; ++i)
    for (std::size_t j = 0; j < decimal.samples[i].w.size(); ++j)
      if (!decimal.samples[i].weight.empty())
        worst = std::max(worst, std::abs(static_cast<double>(decimal.samples[i].weight[j]) -
                                         static_cast<double>(truth.samples[i].weight[j])));
  fmt::print("\n## The optimum: error and time\n\n");
  fmt::print(
      "262 photos, {} random samples, {:.1f} correlated photos a sample. Oracle: long double on all of them, within "
      "{:.1g} of 50 digits on {}; ",
      samples, truth.correlated, worst, decimal_samples);
  {
    std::vector<Eigen::Vector3d> D;
    for (const RenderView& v : desk.sources.views) D.push_back(v.centre - desk.view.centre);
    const OracleLeaves<long double> leaves(base.settings.r_min_rad, base.settings.r_max_rad);
    std::vector<double> moved(samples);
    ParallelFor(samples, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        ExactRay ray{&D, (base.ray_from_pixel * pixels[i].homogeneous()).normalized(), 0};
        ray.t = desk.Distance(ray.direction);
        const auto exact =
            OracleOptimum<long double>(base, nullptr, random.direction[i], random.t[i], leaves, 0.0L, &ray);
        for (std::size_t j = 0; j < exact.weight.size(); ++j)
          moved[i] = std::max(moved[i], static_cast<double>(std::abs(exact.weight[j] - truth.samples[i].weight[j])));
      }
    });
    std::sort(moved.begin(), moved.end());
    fmt::print("rays and centres are stored in float, which alone moves a weight by up to {:.0e}, median {:.0e}. ",
               moved.back(), moved[samples / 2]);
  }

  const Time plain = PlainTime(base, random, quick ? 40 : 200);
  const double frame_samples = kWidth * kHeight;
  for (const auto& [what, r_min_deg, accuracy] : std::vector<std::tuple<std::string, double, double>>{
           {"accuracy 1e-9", 0.001, 1e-9}, {"leaves of one size", 5, 1e-3}}) {
    RadianceSettings s = Settings(accuracy, 20);
    s.r_min_rad = r_min_deg * kRadPerDeg;
    const ViewSetup setup = setup_for(s);
    RaySamples some = random;
    some.direction.resize(64);
    some.t.resize(64);
    WeightTable table;
    OptimumCounts counts;
    const double ms =
        Measure([&] { WeighOptimal(setup, nullptr, some, table, counts); }, 3).cpu_ms * ThreadCount() / 64;
    fmt::print("Ray by ray ({}): {:.2f} ms a sample, one thread. ", what, ms);
  }

  fmt::print(
      "Times: the wall's median; x: plain over it, both on the cores.\n\n| `--accuracy` | `--cutoff-deg` | `--sum` | "
      "largest error | median | 640x480 s | x | 25x25 ms | x |\n|---|---|---|---|---|---|---|---|---|\n"
      "| plain Cholesky, {:.3f} ms a sample | | | | | {:.0f} | 1 | {:.0f} | 1 |\n",
      plain.cpu_ms, plain.cpu_ms * frame_samples / 1000, plain.cpu_ms * 625);
  const auto row = [&](double accuracy, double cutoff, WeightSum sum) {
    RadianceSettings s = Settings(accuracy, cutoff);
    s.sum = sum;
    const ViewSetup setup = setup_for(s);
    WeightTable table;
    OptimumCounts counts;
    WeighOptimal(setup, nullptr, random, table, counts);
    const Errors e = Compare(table, truth);
    const auto [frame, sparse] = MeasureSpeed(desk, setup, quick ? 1 : 3, quick ? 7 : 41, LaneWidths().front());
    fmt::print("| {:g} | {:g} | {} | {:.1e} | {:.1e} | {:.2f} | {:.0f} | {:.1f} | {:.0f} |\n", accuracy, cutoff,
               Name(sum), e.largest, e.median, frame.median_ms / 1000, plain.cpu_ms * frame_samples / frame.cpu_ms,
               sparse.median_ms, plain.cpu_ms * 625 / sparse.cpu_ms);
  };
  for (const auto& [accuracy, cutoff] :
       std::vector<std::pair<double, double>>{{1e-3, 16.0}, {1e-3, 20.0}, {1e-3, 180.0}, {1e-6, 28.0}, {1e-6, 180.0}})
    row(accuracy, cutoff, WeightSum::kLocalMean);
  std::vector<std::pair<double, Errors>> by_cutoff;
  for (const double cutoff : {10.0, 12.0, 14.0, 16.0, 18.0, 20.0, 24.0, 28.0, 40.0, 180.0}) {
    WeightTable table;
    OptimumCounts counts;
    WeighOptimal(setup_for(Settings(1e-7, cutoff)), nullptr, random, table, counts);
    by_cutoff.emplace_back(cutoff, Compare(table, truth));
  }
  for (const WeightSum sum : {WeightSum::kRenormalise, WeightSum::kConstrained}) {
    RadianceSettings full = Settings(1e-3, 180);
    full.sum = sum;
    SetThreadCount(0);
    truth = MakeTruth<long double>(setup_for(full), random, samples);
    SetThreadCount(2);
    for (const auto& [accuracy, cutoff] :
         std::vector<std::pair<double, double>>{{1e-3, 20.0}, {1e-3, 180.0}, {1e-6, 180.0}})
      row(accuracy, cutoff, sum);
  }
  fmt::print(
      "\n## The optimum: what a cutoff leaves out\n\nIn double, against the full system.\n\n| `--cutoff-deg` | largest "
      "error | median |\n|---|---|---|\n");
  for (const auto& [cutoff, e] : by_cutoff) fmt::print("| {:g} | {:.0e} | {:.0e} |\n", cutoff, e.largest, e.median);
}

}  // namespace
}  // namespace lumi::test

int main(int argc, char** argv) {
  const std::string option = argc > 1 ? argv[1] : "";
  if (option == "--widths")
    lumi::test::Widths();
  else
    lumi::test::Main(option == "--quick");
}
