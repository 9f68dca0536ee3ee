#include "render/tradeoff/fidelity.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/settings_json.h"
#include "render/tradeoff/frame_error.h"
#include "render/tradeoff/sweep.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

constexpr double kSameQualityDb = 0.1;  // held-out PSNR: an invisible difference
constexpr int kFaithfulGrids[] = {25, 50, 100};
constexpr double kEqualDb = 99;

bool HasSparseIdentity(const RadianceSettings& s) { return HasSamples(s) && s.similarity == Similarity::kIdentity; }

// Restores the `fixed` options where a front or the table changed them.
RadianceSettings Keeping(RadianceSettings s, const FixedOptions& fixed) {
  for (const auto& [name, value] : fixed) SetOption(s, name, value);
  return s;
}

struct Pictures {
  std::vector<ImageF> of_request;
  double ms = 0;  // the median
};

// `settings` at each request's own moment.
Pictures Render(Renderer& renderer, const std::vector<RenderRequest>& requests, const RadianceSettings& settings) {
  Pictures made;
  std::vector<double> times;
  for (RenderRequest request : requests) {
    const double time_s = request.settings.time_s;
    request.settings = settings;
    request.settings.time_s = time_s;
    const Stopwatch watch;
    made.of_request.push_back(renderer.Render(request));
    times.push_back(1000 * watch.Seconds());
  }
  made.ms = Median(times);
  return made;
}

double WorstDb(const Pictures& pictures, const Pictures& reference) {
  double worst = kEqualDb;
  for (std::size_t i = 0; i < pictures.of_request.size(); ++i) {
    // Summed over the three channels.
    const double mse = SquaredError(pictures.of_request[i], reference.of_request[i]) / 3;
    if (mse > 0) worst = std::min(worst, 10 * std::log10(255.0 * 255.0 / mse));
  }
  return worst;
}

}  // namespace

void ListKeys(JsonKeys& j, FidelityTrial& t) {
  j("name", t.name, "db", t.db);
  if (!t.failed.empty()) j("failed", t.failed);
}

void ListKeys(JsonKeys& j, FidelityChoice& c) {
  j("wanted_db", c.wanted_db, "name", c.name, "db", c.db, "ms", c.ms, "pixel_ms", c.pixel_ms, "why", c.why, "tried",
    c.tried);
}

std::string Describe(const FidelityChoice& c) {
  if (!c.db) return fmt::format("a weight at every pixel, {:.1f} ms a frame: {}", c.pixel_ms, c.why);
  return fmt::format("{}, {:.1f} ms a frame (a weight at every pixel: {:.1f} ms, {:.1f} dB from it at worst); {}",
                     c.name, c.ms, c.pixel_ms, *c.db, c.why);
}

std::vector<std::size_t> FidelityFrames(std::size_t count) {
  const std::size_t n = std::min<std::size_t>(count, kFidelityFrames);
  std::vector<std::size_t> frames;
  for (std::size_t i = 0; i < n; ++i) frames.push_back((2 * i + 1) * count / (2 * n));
  return frames;
}

std::vector<FrontPoint> FidelityTable(const RadianceSettings& base, const std::vector<FrontPoint>& points,
                                      const FixedOptions& fixed) {
  std::vector<FrontPoint> table;
  const auto add = [&](FrontPoint p) {
    const auto same = [&](const FrontPoint& q) { return q.settings == p.settings; };
    if (HasSparseIdentity(p.settings) && Validate(p.settings).empty() && std::ranges::none_of(table, same))
      table.push_back(std::move(p));
  };
  std::vector<FrontPoint> of_front;
  double best = -std::numeric_limits<double>::infinity();
  for (FrontPoint p : points) {
    p.settings = WithTradedSettings(base, p.settings);
    if (Keeping(p.settings, fixed) != p.settings || !HasSparseIdentity(p.settings)) continue;
    best = std::max(best, p.Quality());
    of_front.push_back(std::move(p));
  }
  std::ranges::stable_sort(of_front, {}, &FrontPoint::ms);
  for (FrontPoint& p : of_front)
    if (p.Quality() >= best - kSameQualityDb) add(std::move(p));
  for (const int grid : kFaithfulGrids) {
    FrontPoint p;
    p.settings = Keeping(WithMethod(base, Method::kCandidates, grid), fixed);
    p.name = PointName(p.settings, base);
    add(std::move(p));
  }
  return table;
}

FidelityChoice ChooseFaithful(Renderer& renderer, const std::vector<RenderRequest>& requests,
                              const RadianceSettings& base, const std::vector<FrontPoint>& table, double wanted_db) {
  FidelityChoice choice;
  choice.wanted_db = wanted_db;
  choice.settings = PerPixel(base);
  choice.name = PointName(choice.settings, base);
  std::optional<RadianceSettings> referred;  // settings of `reference`, which all settings with the same k share
  Pictures reference;
  const auto refer_to = [&](const RadianceSettings& settings) {
    if (referred == settings) return;
    referred.reset();
    reference = Render(renderer, requests, settings);
    referred = settings;
  };
  for (const FrontPoint& p : table) {
    FidelityTrial trial{p.name, {}, {}};
    try {
      refer_to(PerPixel(p.settings));
      const Pictures pictures = Render(renderer, requests, p.settings);
      trial.db = WorstDb(pictures, reference);
      if (*trial.db >= wanted_db) {
        choice.name = p.name;
        choice.settings = p.settings;
        choice.db = trial.db;
        choice.ms = pictures.ms;
      }
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& e) {
      trial.failed = e.what();
    }
    choice.tried.push_back(std::move(trial));
    if (choice.db) break;
  }
  if (!choice.db) {
    refer_to(choice.settings);
    choice.ms = reference.ms;
    const auto nearest = std::ranges::max_element(choice.tried, {}, [](const FidelityTrial& t) {
      return t.db.value_or(-std::numeric_limits<double>::infinity());
    });
    choice.why = nearest == choice.tried.end() ? "no sparse samples go with the options given"
                 : nearest->db ? fmt::format("no sparse samples come within {:g} dB of it ({}: {:.1f} dB)", wanted_db,
                                             nearest->name, *nearest->db)
                               : fmt::format("no sparse samples can be used ({}: {})", nearest->name, nearest->failed);
  }
  choice.pixel_ms = reference.ms;
  return choice;
}

FidelityChoice ChooseFaithful(const std::filesystem::path& scene_folder, const std::string& backend,
                              const std::string& proxy, Renderer& renderer, const std::vector<RenderRequest>& requests,
                              const RadianceSettings& base, const FixedOptions& fixed, double wanted_db) {
  const Eigen::Vector2i size = requests.front().view.size_px;
  std::string why;
  std::vector<FrontPoint> points;
  if (auto stored = FindFront(scene_folder, {proxy, backend, renderer.Device(), size.x(), size.y()}, &why)) {
    points = std::move(stored->points);
    why = fmt::format("the scene's front, measured at {}x{}, was asked first", stored->key.width, stored->key.height);
  }
  FidelityChoice choice = ChooseFaithful(renderer, requests, base, FidelityTable(base, points, fixed), wanted_db);
  choice.why += (choice.why.empty() ? "" : "; ") + why;
  return choice;
}

}  // namespace lumi
