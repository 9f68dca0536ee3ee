#include "render/tradeoff/tradeoff.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <random>

#include "render/holdout/holdout.h"
#include "render/radiance/frame_plan.h"
#include "render/tradeoff/frame_error.h"
#include "render/tradeoff/measure.h"
#include "render/tradeoff/ray_bench.h"
#include "render/tradeoff/sweep.h"
#include "render/world/visibility_maps.h"
#include "scene/files/atomic_file.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

struct Figure {
  std::string key;
  std::optional<double> value;  // nullopt: not available
  bool count = false;           // a whole number
};
using Figures = std::vector<Figure>;

struct Property {
  std::string name, figure;  // what the figures are, for people
  Figures values;
};

void ListKeys(JsonKeys& j, Property& p) {
  j("property", p.name, "figure", p.figure);
  for (const Figure& f : p.values)
    if (f.value && f.count)
      j.Say(f.key.c_str(), std::lround(*f.value));
    else
      j.Say(f.key.c_str(), f.value);
}

constexpr const char* kPropertiesMarker = "properties.json";
constexpr int kRays = 200;                   // random rays of a figure
constexpr int kOwnWidth = 96;                // of the pictures at all source cameras
constexpr std::size_t kOptimumCameras = 12;  // at which the optimum solves every pixel
constexpr float kInner = 0.999F;             // field-of-view value of a pixel that lies wholly within the photo

// Ranks with ties sharing their mean.
std::vector<double> Ranks(const std::vector<double>& v) {
  std::vector<std::size_t> order(v.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return v[a] < v[b]; });
  std::vector<double> ranks(v.size());
  for (std::size_t i = 0; i < order.size();) {
    std::size_t j = i;
    while (j < order.size() && v[order[j]] == v[order[i]]) ++j;
    for (std::size_t k = i; k < j; ++k) ranks[order[k]] = 0.5 * static_cast<double>(i + j - 1);
    i = j;
  }
  return ranks;
}

double Pearson(const std::vector<double>& a, const std::vector<double>& b) {
  const double n = static_cast<double>(a.size());
  const double ma = std::accumulate(a.begin(), a.end(), 0.0) / n, mb = std::accumulate(b.begin(), b.end(), 0.0) / n;
  double ab = 0, aa = 0, bb = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ab += (a[i] - ma) * (b[i] - mb);
    aa += (a[i] - ma) * (a[i] - ma);
    bb += (b[i] - mb) * (b[i] - mb);
  }
  return aa > 0 && bb > 0 ? ab / std::sqrt(aa * bb) : 0;
}

class Properties {
 public:
  Properties(const MeasureOptions& o, ProgressSink& sink)
      : o_(o),
        sink_(sink),
        bench_(o, kPropertiesMarker, sink),
        proxy_(bench_.proxies().front()),
        rays_(bench_.scene(), bench_.mesh(proxy_)),
        sources_(rays_.sources()) {
    settings_ = WithMethod(bench_.settings(), Method::kPixel);
    if (settings_.k == 0) settings_.k = 4;
  }

  Answer Run() {
    std::vector<Property> properties;
    Progress progress(sink_, "measuring properties", 9);
    const auto add = [&](const char* name, const char* what, Figures figures) {
      properties.push_back({name, what, std::move(figures)});
      progress.Step();
    };
    const Figures own = Epipoles();
    add("unstructured input", "photos that some pixel shows, of all",
        {{"used", own[1].value, true}, {"cameras", own[0].value, true}});
    add("natural navigation",
        "largest change of a weight under another camera matrix; of a picture under a turn by 90 degrees, code values",
        Navigation());
    add("real-time performance", "milliseconds a frame", RealTime());
    add("use of correspondence", "held-out PSNR with the proxy, with a plane, with a plane at infinity",
        Correspondence());
    add("angle-based view dependence",
        "error of a colour that is the direction itself, median over rays; rank correlation of weight and angle, "
        "effects on",
        ViewDependence());
    add("epipole consistency", "smallest weight of a photo at its own camera", own);
    add("radiance consistency", "largest difference of a weight for one ray from two viewpoints",
        RadianceConsistency());
    add("continuity", "largest change of a weight a step", Continuity());
    add("sensitivity to non-ideal effects", "held-out PSNR and coverage with an effect, and without", NonIdeal());
    const std::string proxy = proxy_.empty() ? scene().active_proxy : proxy_, device = bench_.Measured(proxy_).Device();
    JsonKeys keys;
    keys.Say("scene", o_.scene.generic_string()).Say("proxy", proxy).Say("backend", o_.backend).Say("device", device);
    keys.Say("settings", bench_.Keys(settings_)).Say("properties", properties);
    if (!o_.output.empty()) WriteTextAtomically(o_.output / kPropertiesMarker, keys.Text(1) + "\n");
    std::string text;
    for (const Property& p : properties) {
      text += fmt::format("{}: {}\n", p.name, p.figure);
      for (const Figure& f : p.values)
        text += fmt::format("    {:<40} {}\n", f.key,
                            !f.value  ? "not available"
                            : f.count ? fmt::format("{:.0f}", *f.value)
                                      : fmt::format("{:.6g}", *f.value));
    }
    return {keys, text + fmt::format("proxy {}, {}", proxy, device)};
  }

 private:
  const Scene& scene() const { return bench_.scene(); }

  using Ray = RayBench::Ray;
  std::vector<double> WeightsAt(const Eigen::Vector3d& eye, const Eigen::Vector3d& p, const RadianceSettings& s,
                                const Eigen::Matrix3d& KR) const {
    return rays_.WeightsAt(eye, p, s, KR);
  }
  static double Largest(const std::vector<double>& a, const std::vector<double>& b) {
    return RayBench::LargestDifference(a, b);
  }

  Figures Navigation() {
    RadianceSettings s = settings_;
    s.resolution = Resolution::kOff;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> both(-1, 1);
    double worst = 0;
    for (const Ray& ray : rays_.RandomRays(kRays)) {
      const Eigen::Matrix3d facing = rays_.Facing(ray.eye, ray.p);
      // Rolled, sheared, off centre, another focal length: the ray to p is the same.
      Eigen::Matrix3d change;
      change << 1 + 0.5 * both(random), 0.3 * both(random), 200 * both(random), 0.3 * both(random),
          1 + 0.5 * both(random), 200 * both(random), 0, 0, 1;
      worst =
          std::max(worst, Largest(WeightsAt(ray.eye, ray.p, s, facing), WeightsAt(ray.eye, ray.p, s, change * facing)));
    }
    // A picture turned by 90 degrees: pixel (x, y) of one is (h - 1 - y, x) of the other.
    const TestView t = Views().front();
    RenderRequest r = bench_.Request(t, settings_);
    const ImageF upright = bench_.Cpu(proxy_).Render(r);
    Eigen::Matrix3d turn;
    turn << 0, -1, t.view.size_px.y(), 1, 0, 0, 0, 0, 1;
    r.view.P = turn * t.view.P;
    r.view.size_px = {t.view.size_px.y(), t.view.size_px.x()};
    const ImageF turned = bench_.Cpu(proxy_).Render(r);
    double change = 0;
    for (int y = 0; y < upright.height; ++y)
      for (int x = 0; x < upright.width; ++x)
        for (int c = 0; c < 3; ++c)
          change =
              std::max(change, 255.0 * std::abs(double(upright.At(x, y, c)) - turned.At(upright.height - 1 - y, x, c)));
    return {{"weight_change_max", worst}, {"turned_difference_max", change}};
  }

  std::vector<TestView> Views() const {
    return HeldOutViews(scene(), o_.holdout, Fold::kReport, o_.views, bench_.Width());
  }

  Figures RealTime() {
    Figures figures = {{"width", bench_.Width(), true}};
    const TestView t = Views().front();
    const auto time = [&](const char* key, const RadianceSettings& s) {
      std::optional<double> ms;
      try {
        ms = TimeFrame(bench_.Measured(proxy_), bench_.Request(t, s), o_.repeats).ms;
      } catch (const Interrupted&) {
        throw;
      } catch (const std::exception&) {  // the backend does not do it
      }
      figures.push_back({key, ms});
    };
    time("pixel_ms", settings_);
    time("interpolated_25_ms", WithMethod(bench_.settings(), Method::kInterpolated));
    time("candidates_25_ms", WithMethod(bench_.settings(), Method::kCandidates));
    time("optimum_25_ms", WithMethod(bench_.settings(), Method::kOptimumGrid));
    return figures;
  }

  FrameError HeldOut(Renderer& renderer, const RadianceSettings& s) {
    std::vector<FrameError> errors;
    for (const TestView& t : Views())
      errors.push_back(ErrorAgainstPhoto(renderer.Render(bench_.Request(t, s)), t.photo));
    return Mean(errors);
  }

  Figures Correspondence() {
    const Mesh plane = FacingPlane(scene(), 1), infinity = FacingPlane(scene(), kAtInfinity);
    const auto with_plane = bench_.lumigraph().NewRenderer(MakeCpuRenderer, plane),
               with_infinity = bench_.lumigraph().NewRenderer(MakeCpuRenderer, infinity);
    return {{"proxy_psnr_db", HeldOut(bench_.Cpu(proxy_), settings_).psnr_db},
            {"plane_psnr_db", HeldOut(*with_plane, settings_).psnr_db},
            {"infinity_psnr_db", HeldOut(*with_infinity, settings_).psnr_db}};
  }

  // In a synthetic world, the colour at a point is the direction from which it is seen: known, and fully
  // view-dependent. The blended colour is compared with the ray's own direction. Baselines: the photo nearest in angle
  // alone, and the mean of all photos that see the point (as a texture would have).
  Figures ViewDependence() {
    RadianceSettings everyone = settings_;
    everyone.k = 0;
    everyone.method = Algorithm::kUlr;
    std::vector<double> blended, nearest, textured;
    std::vector<double> correlations;
    for (const Ray& ray : rays_.RandomRays(kRays)) {
      const Eigen::Matrix3d facing = rays_.Facing(ray.eye, ray.p);
      const Eigen::Vector3d back = (ray.eye - ray.p).normalized();
      const std::vector<double> weights = WeightsAt(ray.eye, ray.p, settings_, facing),
                                all = WeightsAt(ray.eye, ray.p, everyone, facing);
      std::vector<double> angles;
      Eigen::Vector3d mean = Eigen::Vector3d::Zero(), of_all = Eigen::Vector3d::Zero();
      double sum = 0, seeing = 0, least = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < sources_.views.size(); ++j) {
        const Eigen::Vector3d u = (sources_.views[j].centre - ray.p).normalized();
        angles.push_back(2 * std::atan2((u - back).norm(), (u + back).norm()));
        mean += weights[j] * u;
        sum += weights[j];
        if (!(all[j] > 0)) continue;
        of_all += u;
        ++seeing;
        least = std::min(least, angles.back());
      }
      if (!(sum > 0) || !(seeing > 0)) continue;
      blended.push_back((mean / sum - back).norm());
      textured.push_back((of_all / seeing - back).norm());
      nearest.push_back(2 * std::sin(0.5 * least));
      if (const auto c = RankCorrelation(all, angles)) correlations.push_back(*c);
    }
    if (blended.empty()) return {{"rays", 0, true}};
    return {{"rays", static_cast<double>(blended.size()), true},
            {"direction_error", Median(blended)},
            {"nearest_photo_direction_error", Median(nearest)},
            {"all_photos_direction_error", Median(textured)},
            {"rank_correlation_median", correlations.empty() ? std::nullopt : std::optional(Median(correlations))}};
  }
  static std::optional<double> RankCorrelation(const std::vector<double>& weights, const std::vector<double>& angles) {
    // Cameras that do not see p all have weight 0 and cannot be ranked. At least three others are needed for a rank
    // correlation.
    std::vector<double> w, a;
    for (std::size_t i = 0; i < weights.size(); ++i)
      if (weights[i] > 0) {
        w.push_back(weights[i]);
        a.push_back(angles[i]);
      }
    if (w.size() < 3) return std::nullopt;
    return Pearson(Ranks(w), Ranks(a));
  }

  // At each source camera, its own photo is white and all others are black: the picture then shows the weight of the
  // camera's own photo, for any method.
  Figures Epipoles() {
    std::vector<Photo> photos(scene().views.size());
    for (Photo& p : photos) p.levels = {Image8(1, 1, 3, 0)};
    const auto renderer =
        MakeCpuRenderer(WorldOf(scene(), bench_.mesh(proxy_)), photos);  // reads the photos at every frame
    RadianceSettings pixel = settings_;
    pixel.resolution = Resolution::kOff;
    pixel.time = false;
    // The optimum gives a photo back only where f v = 1: inside its border and, with visibility, away from silhouettes,
    // beside which depth maps are feathered. So it is measured with and without visibility.
    RadianceSettings clear = pixel;
    clear.visibility = false;
    struct Case {
      const char* key;
      RadianceSettings settings;
      bool inner_only;
      std::size_t most_cameras = std::numeric_limits<std::size_t>::max();
      double smallest = 1, sum = 0;
      long pixels = 0;
      std::string refused = {};
    };
    Case cases[] = {{"pixel", pixel, false},
                    {"interpolated_25", WithMethod(pixel, Method::kInterpolated), false},
                    {"candidates_25", WithMethod(pixel, Method::kCandidates), false},
                    {"optimum_25", WithMethod(clear, Method::kOptimumGrid), true},
                    {"optimum_pixel", WithMethod(clear, Method::kOptimumPixel), true, kOptimumCameras},
                    {"optimum_25_visibility", WithMethod(pixel, Method::kOptimumGrid), true},
                    {"optimum_pixel_visibility", WithMethod(pixel, Method::kOptimumPixel), true, kOptimumCameras}};
    int used = 0;
    for (std::size_t j = 0; j < photos.size(); ++j) {
      photos[j].levels[0] = Image8(1, 1, 3, 255);
      RenderRequest r;
      r.view = HeldOutView(scene(), scene().views[j], kOwnWidth);
      for (Case& c : cases) {
        if (!c.refused.empty() || j % (1 + photos.size() / c.most_cameras) != 0) continue;
        r.settings = c.settings;
        try {
          const ImageF image = renderer->Render(r);
          bool seen = false;
          for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
              const float alpha = image.At(x, y, 3);
              // Only fully opaque pixels: at its border a photo fades into a hole.
              if (!(alpha > kInner) || (c.inner_only && !Inner(x, y, image, c.settings))) continue;
              const double weight = image.At(x, y, 0) / alpha;
              c.smallest = std::min(c.smallest, weight);
              c.sum += weight;
              ++c.pixels;
              seen = seen || weight > 0.5;
            }
          if (&c == &cases[0] && seen) ++used;
        } catch (const Interrupted&) {
          throw;
        } catch (const std::exception& e) {
          c.refused = e.what();
        }
      }
      photos[j].levels[0] = Image8(1, 1, 3, 0);
    }
    Figures figures = {{"cameras", static_cast<double>(photos.size()), true}, {"cameras_used", used, true}};
    for (const Case& c : cases) {
      const bool known = c.refused.empty() && c.pixels > 0;
      figures.push_back({std::string(c.key) + "_weight_min", known ? std::optional(c.smallest) : std::nullopt});
      figures.push_back({std::string(c.key) + "_weight_mean",
                         known ? std::optional(c.sum / static_cast<double>(c.pixels)) : std::nullopt});
    }
    return figures;
  }
  // Where the photo's own field-of-view value is 1, at the samples around, too: a cell that reaches into the border
  // interpolates what holds there.
  static bool Inner(int x, int y, const ImageF& image, const RadianceSettings& s) {
    const double border = s.field_of_view ? s.fov_feather * std::min(image.width, image.height) : 0;
    const double cell_x = s.Sparse() ? image.width / (s.grid_columns - 1.0) : 0,
                 cell_y = s.Sparse() ? image.height / (s.grid_rows - 1.0) : 0;
    return std::min(x + 0.5, image.width - x - 0.5) > border + cell_x &&
           std::min(y + 0.5, image.height - y - 0.5) > border + cell_y;
  }

  Figures RadianceConsistency() {
    RadianceSettings s = settings_;
    s.resolution = Resolution::kOff;
    double worst = 0;
    for (const Ray& ray : rays_.RandomRays(kRays))
      for (const double share : {0.2, 0.5, 0.8}) {
        const Eigen::Vector3d nearer = ray.eye + share * (ray.p - ray.eye);
        worst = std::max(worst, Largest(WeightsAt(ray.eye, ray.p, s, rays_.Facing(ray.eye, ray.p)),
                                        WeightsAt(nearer, ray.p, s, rays_.Facing(nearer, ray.p))));
      }
    return {{"weight_difference_max", worst}};
  }

  Figures Continuity() {
    // The view moves along straight lines of a tenth of a scene size, looking at one point p of the proxy, in three
    // step sizes. Parts where the ray to p passes a camera closer than `clear` are left out: at an epipole, slopes grow
    // without bound.
    const RadianceSettings& s = settings_;
    constexpr double kLength = 0.1;
    constexpr int kSteps[] = {10, 100, 1000};
    const double clear = std::min(0.02, 0.3 * rays_.Spacing());
    double largest[] = {0, 0, 0};
    long measured = 0;
    const auto passes = [&](const Eigen::Vector3d& eye, const Eigen::Vector3d& p) {
      const Eigen::Vector3d d = (p - eye).normalized();
      return std::any_of(sources_.views.begin(), sources_.views.end(),
                         [&](const RenderView& v) { return (v.centre - eye).cross(d).norm() < clear; });
    };
    const std::vector<Ray> rays = rays_.RandomRays(40);
    for (std::size_t i = 0; i + 1 < rays.size(); i += 2) {
      const Eigen::Vector3d p = rays[i].p, from = rays[i].eye, to = rays[i + 1].eye;
      if (!((to - from).norm() > 0)) continue;
      const Eigen::Vector3d way = kLength * (to - from).normalized();
      // Each tenth of a line is checked at 5 positions for epipoles, so that all step sizes use the same parts.
      for (int tenth = 0; tenth < 10; ++tenth) {
        bool near = false;
        for (int n = 0; n <= 4; ++n) near = near || passes(from + (tenth + 0.25 * n) / 10 * way, p);
        if (near || (from + 0.1 * tenth * way - p).norm() < 2 * kLength) continue;
        ++measured;
        for (std::size_t k = 0; k < 3; ++k) {
          const int steps = kSteps[k] / 10;
          std::vector<double> before;
          for (int n = 0; n <= steps; ++n) {
            const Eigen::Vector3d eye = from + (tenth + static_cast<double>(n) / steps) / 10 * way;
            std::vector<double> now = WeightsAt(eye, p, s, rays_.Facing(eye, p));
            if (n > 0) largest[k] = std::max(largest[k], Largest(before, now));
            before = std::move(now);
          }
        }
      }
    }
    if (measured == 0) return {{"stretches", 0, true}};
    return {{"stretches", static_cast<double>(measured), true},
            {"clear_of_epipoles", clear},
            {"change_at_step_1e-2", largest[0]},
            {"change_at_step_1e-3", largest[1]},
            {"change_at_step_1e-4", largest[2]},
            {"ratio_1e-2_1e-3", largest[1] > 0 ? std::optional(largest[0] / largest[1]) : std::nullopt},
            {"ratio_1e-3_1e-4", largest[2] > 0 ? std::optional(largest[1] / largest[2]) : std::nullopt}};
  }

  Figures NonIdeal() {
    Figures figures;
    const auto measure = [&](const char* key, const RadianceSettings& s) {
      const FrameError error = HeldOut(bench_.Cpu(proxy_), s);
      figures.push_back({std::string(key) + "_psnr_db", error.psnr_db});
      figures.push_back({std::string(key) + "_coverage", error.coverage});
    };
    RadianceSettings on = settings_;
    on.field_of_view = on.visibility = true;
    measure("fov_and_visibility", on);
    RadianceSettings s = on;
    s.field_of_view = false;
    measure("without_fov", s);
    s = on;
    s.visibility = false;
    measure("without_visibility", s);
    s = on;
    s.resolution = Resolution::kJacobian;
    measure("with_resolution", s);
    s.resolution = Resolution::kOff;
    measure("without_resolution", s);
    return figures;
  }

  const MeasureOptions& o_;
  ProgressSink& sink_;
  Workbench bench_;
  const std::string proxy_;
  const RayBench rays_;
  const Sources& sources_;
  RadianceSettings settings_;
};

}  // namespace

Answer RunProperties(const MeasureOptions& options, ProgressSink& progress) {
  return Properties(options, progress).Run();
}

}  // namespace lumi
