#include "reconstruct/measure_scene.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/median.h"
#include "scene/geometry/projection.h"
#include "scene/program/error.h"
#include "scene/triangulation/triangulate.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr double kMostApart_px = 10, kLeastAngle_rad = 0.5 * std::numbers::pi / 180;
constexpr const char* kPlaces =
    "a place is PHOTO (its camera), PHOTO:X,Y (what a pixel shows), PHOTO:X,Y+PHOTO:X,Y, or X,Y,Z";

struct Pixel {
  const View* view = nullptr;
  Eigen::Vector2d x_px = Eigen::Vector2d::Zero();
};

const View* FindView(const Scene& scene, const std::string& name) {
  const auto it = std::ranges::find(scene.views, name, &View::name);
  return it == scene.views.end() ? nullptr : &*it;
}

// So many finite numbers with commas between, and nothing else.
std::optional<std::vector<double>> Numbers(std::string_view text, std::size_t count) {
  std::vector<double> numbers;
  while (true) {
    double number = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
    numbers.push_back(number);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (text.empty()) break;
    if (text.front() != ',') return std::nullopt;
    text.remove_prefix(1);
  }
  if (numbers.size() != count) return std::nullopt;
  return numbers;
}

std::optional<Pixel> PixelOf(const Scene& scene, const std::string& text) {
  const auto colon = text.rfind(':');
  if (colon == std::string::npos) return std::nullopt;
  const auto x = Numbers(std::string_view(text).substr(colon + 1), 2);
  if (!x) return std::nullopt;
  const std::string name = text.substr(0, colon);
  const View* view = FindView(scene, name);
  if (!view) return std::nullopt;
  const Eigen::Vector2d x_px((*x)[0], (*x)[1]);
  const Eigen::Vector2i size = SizePx(scene, *view);
  if (x_px.minCoeff() < 0 || x_px.x() > size.x() || x_px.y() > size.y())
    throw UsageError(
        fmt::format("pixel {:g},{:g} lies outside of {}, which is {}x{}", x_px.x(), x_px.y(), name, size.x(), size.y()),
        "pixels are those of the scene's images/, from their corner");
  return Pixel{view, x_px};
}

// PHOTO:X,Y+PHOTO:X,Y ...: names may hold a plus themselves.
std::vector<Pixel> PixelsOf(const Scene& scene, const std::string& text) {
  if (const auto one = PixelOf(scene, text)) return {*one};
  for (auto plus = text.find('+'); plus != std::string::npos; plus = text.find('+', plus + 1)) {
    const auto first = PixelOf(scene, text.substr(0, plus));
    if (!first) continue;
    std::vector<Pixel> rest = PixelsOf(scene, text.substr(plus + 1));
    if (rest.empty()) continue;
    rest.insert(rest.begin(), *first);
    return rest;
  }
  return {};
}

// How far along the ray it meets the triangle; Moeller and Trumbore 1997.
std::optional<double> MeetsTriangle(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray, const Eigen::Vector3d& a,
                                    const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, p = ray.cross(ac), t = origin - a, q = t.cross(ab);
  const double volume = ab.dot(p);
  if (volume == 0) return std::nullopt;
  const double u = t.dot(p) / volume, v = ray.dot(q) / volume, distance = ac.dot(q) / volume;
  if (!(u >= 0 && v >= 0 && u + v <= 1 && distance > 0)) return std::nullopt;
  return distance;
}

std::optional<Eigen::Vector3d> OnProxy(const Scene& scene, const Pixel& pixel, const Mesh& proxy) {
  const RenderView view = MakeRenderView(scene, *pixel.view);
  const auto ray = RayDirection(view.P, pixel.x_px);
  if (!ray) return std::nullopt;
  double nearest = std::numeric_limits<double>::infinity();
  const auto at = [&](std::int32_t i) { return proxy.vertices[static_cast<std::size_t>(i)]; };
  for (const auto& [a, b, c] : proxy.faces)
    if (const auto distance = MeetsTriangle(view.centre, *ray, at(a), at(b), at(c)))
      nearest = std::min(nearest, *distance);
  if (!std::isfinite(nearest)) return std::nullopt;
  return view.centre + nearest * *ray;
}

Eigen::Vector3d PointOf(const Scene& scene, const std::vector<Pixel>& pixels, const Mesh* proxy,
                        const std::string& place) {
  if (pixels.size() == 1) {
    if (!proxy)
      throw UsageError(fmt::format("{} is one pixel, and the scene has no proxy that says what it shows", place),
                       "give the same thing in two photos (a.jpg:X,Y+b.jpg:X,Y), or make a proxy: lumi-proxy auto");
    const auto x = OnProxy(scene, pixels.front(), *proxy);
    if (!x)
      throw DataError(fmt::format("{} shows nothing of the proxy", place),
                      "take another pixel, or the same thing in two photos (a.jpg:X,Y+b.jpg:X,Y)");
    return *x;
  }
  std::vector<Matrix34d> P;
  std::vector<Eigen::Vector2d> x_px;
  for (const Pixel& pixel : pixels) {
    P.push_back(MakeRenderView(scene, *pixel.view).P);
    x_px.push_back(pixel.x_px);
  }
  const auto point = Triangulate(P, x_px);
  if (!point || point->max_angle_rad < kLeastAngle_rad)
    throw DataError(fmt::format("the rays of {} meet nowhere or under less than half a degree", place),
                    "take photos from places that are farther apart");
  if (point->rms_px > kMostApart_px)
    throw DataError(fmt::format("the pixels of {} show no one point: they are {:.0f} px off", place, point->rms_px),
                    "point at the same thing in each photo");
  return point->x_in_world;
}

struct Place {
  std::string text;
  std::vector<Pixel> pixels;  // none: `fixed`
  Eigen::Vector3d fixed = Eigen::Vector3d::Zero();
  std::string from;
};

Place Parse(const Scene& scene, const std::string& text) {
  Place place{text, PixelsOf(scene, text), {}, "photos"};
  if (!place.pixels.empty()) {
    if (place.pixels.size() == 1) place.from = "proxy";
    return place;
  }
  if (const View* view = FindView(scene, text)) {
    place.fixed = view->CentreInWorld();
    place.from = "camera";
    return place;
  }
  const auto x = Numbers(text, 3);
  if (!x) throw UsageError(fmt::format("\"{}\" is no place in the scene, and no photo of it", text), kPlaces);
  place.fixed = Eigen::Vector3d((*x)[0], (*x)[1], (*x)[2]);
  place.from = "world";
  return place;
}

Eigen::Vector3d Where(const Scene& scene, const Place& place, const Mesh* proxy) {
  return place.pixels.empty() ? place.fixed : PointOf(scene, place.pixels, proxy, place.text);
}

// The sum of squared changes of `distance` where each pixel of the place is one off along each axis.
double ChangeForAPixel(const Scene& scene, const Place& place, const Eigen::Vector3d& other, double distance,
                       const Mesh* proxy) {
  double sum = 0;
  for (std::size_t i = 0; i < place.pixels.size(); ++i)
    for (int axis = 0; axis < 2; ++axis) {
      Place moved = place;
      moved.pixels[i].x_px[axis] += 1;
      try {
        const double change = (Where(scene, moved, proxy) - other).norm() - distance;
        sum += change * change;
      } catch (const DataError&) {  // beside the proxy's edge
      }
    }
  return sum;
}

}  // namespace

void ListKeys(JsonKeys& j, MeasuredPlace& p) { j("place", p.place, "x_in_world", p.x_in_world, "from", p.from); }

void ListKeys(JsonKeys& j, MeasureSummary& s) {
  j("metres_per_unit", s.metres_per_unit, "metres_per_unit_before", s.metres_per_unit_before, "distance", s.distance,
    "percent_for_a_pixel", s.percent_for_a_pixel, "cameras_extent_m", s.cameras_extent_m);
  j("a", s.places[0], "b", s.places[1]);
}

std::string Describe(const MeasureSummary& s) {
  return fmt::format(
      "a unit of the scene is {:.6g} m{}: {:.4g} m between the two places ({:.4g} units{}); the cameras stand within "
      "{:.3g} m",
      s.metres_per_unit, s.metres_per_unit_before ? fmt::format(" ({:.6g} before)", *s.metres_per_unit_before) : "",
      s.metres_per_unit * s.distance, s.distance,
      s.percent_for_a_pixel > 0 ? fmt::format(", {:.2g} % more or less for a pixel", s.percent_for_a_pixel) : "",
      s.cameras_extent_m);
}

MeasuredPlace FindPlace(const Scene& scene, const std::string& text, const Mesh* proxy) {
  const Place place = Parse(scene, text);
  return {text, Where(scene, place, proxy), place.from};
}

MeasureSummary Measure(const Scene& scene, const MeasureOptions& options, const Mesh* proxy) {
  if (!(options.metres > 0) || !std::isfinite(options.metres))
    throw UsageError(fmt::format("{:g} m is no distance", options.metres), "give metres above 0");
  const Place a = Parse(scene, options.a), b = Parse(scene, options.b);
  const Eigen::Vector3d at = Where(scene, a, proxy), bt = Where(scene, b, proxy);
  MeasureSummary s;
  s.distance = (at - bt).norm();
  // Relative to how far off the places lie: nearer than that, they are equal to rounding.
  const double far = std::max(at.norm(), bt.norm());
  if (!(s.distance > 1e-9 * far)) throw DataError("the two places are one", "measure between two");
  s.metres_per_unit = options.metres / s.distance;
  s.metres_per_unit_before = scene.metres_per_unit;
  s.percent_for_a_pixel =
      100 *
      std::sqrt(ChangeForAPixel(scene, a, bt, s.distance, proxy) + ChangeForAPixel(scene, b, at, s.distance, proxy)) /
      s.distance;
  s.places = {MeasuredPlace{a.text, at, a.from}, MeasuredPlace{b.text, bt, b.from}};
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) mean += view.CentreInWorld() / static_cast<double>(scene.views.size());
  for (const View& view : scene.views)
    s.cameras_extent_m = std::max(s.cameras_extent_m, 2 * s.metres_per_unit * (view.CentreInWorld() - mean).norm());
  return s;
}

MeasureSummary MeasureScene(const MeasureOptions& options, ProgressSink& sink) {
  std::error_code ec;
  if (!fs::exists(options.scene, ec)) throw UsageError(options.scene.string() + " does not exist");
  RequireManifest(options.scene);
  OpenOptions as_it_is;
  as_it_is.check_photos = false;
  as_it_is.undistort = false;
  const Scene scene = OpenScene(options.scene, as_it_is, sink);
  RequireMetric(scene, "a scale");
  std::optional<Mesh> proxy;
  if (!scene.active_proxy.empty()) proxy = LoadProxy(scene, "");
  const MeasureSummary summary = Measure(scene, options, proxy ? &*proxy : nullptr);
  WriteScale(options.scene, summary.metres_per_unit);
  return summary;
}

double StepOfCameras(const Scene& scene) {
  std::vector<double> nearest;
  for (const View& view : scene.views) {
    double least = std::numeric_limits<double>::infinity();
    for (const View& other : scene.views)
      if (&other != &view) least = std::min(least, (view.CentreInWorld() - other.CentreInWorld()).norm());
    nearest.push_back(least);
  }
  const double step = nearest.empty() ? 0 : Median(std::move(nearest));
  if (!(step > 0) || !std::isfinite(step)) throw DataError("the cameras have no distance that could be a rig's step");
  return step;
}

}  // namespace lumi
