// What sparse samples cost and lose, on a scene like the thesis's Example #1: 262 photographs of a desk from clusters
// on a dome, a plane for a proxy. Prints tables; no figure here is a test.
//   sparse_blend_bench [time] [views] [psnr] [--pictures DIR] [--scene DIR] [--proxy NAME] [--title WORDS]
// All three tables without an argument.
// --scene takes its photographs and proxy from a scene, for psnr and --pictures: three views are compared, without
// their own photos; where the scene has silhouettes (truth/silhouettes, silhouettes), their white pixels only.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "render/cpu/layers.h"
#include "render/cpu/photo_maps.h"
#include "render/picture/convert.h"
#include "render/radiance/sparse/sparse_plan.h"
#include "render/world/renderer.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/median.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace {

constexpr int kRepeats = 21;
constexpr int kThreads = 2;
constexpr int kWidth = 1024, kHeight = 768;
constexpr std::array<int, 5> kGrids{8, 16, 25, 32, 64};

// A view whose sparse pictures are compared.
struct TestView {
  RenderView view;
  std::vector<bool> use;
  Image8 mask;  // white: counts; empty: all
};

struct World {
  std::vector<TestView> views;
  TestView behind;  // a view with epipoles in it
  Scene scene;
  Mesh proxy;
  std::vector<Photo> photos;
  RenderView view;
  std::vector<bool> use;  // empty: all
};

Rigid3 Looking(const Eigen::Vector3d& from, const Eigen::Vector3d& at) { return LookAt(from, at, {0, -1, 0}); }

// Things that stand before the proxy's plane and a background behind it, so that photos disagree by their parallax.
std::array<std::uint8_t, 3> Shade(const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
  const auto texture = [](double x, double y, double s) -> std::array<std::uint8_t, 3> {
    const double a = std::sin(s * x + std::sin(0.7 * s * y)), b = std::sin(1.3 * s * y - 0.4 * s * x),
                 c = std::sin(9 * s * x) * std::sin(8 * s * y);
    return {static_cast<std::uint8_t>(128 + 60 * a + 40 * c), static_cast<std::uint8_t>(128 + 60 * b + 40 * c),
            static_cast<std::uint8_t>(128 - 50 * a * b + 40 * c)};
  };
  double nearest = (0.25 - o.z()) / d.z();
  Eigen::Vector3d x = o + nearest * d;
  std::array<std::uint8_t, 3> rgb = texture(x.x(), x.y(), 3);
  for (int i = 0; i < 9; ++i) {
    const Eigen::Vector3d centre(1.1 * (i % 3 - 1), 0.8 * (i / 3 - 1), -0.05 * (i % 4));
    const double radius = 0.22 + 0.03 * (i % 3);
    const double b = d.dot(o - centre), c = (o - centre).squaredNorm() - radius * radius, q = b * b - c;
    if (q <= 0 || -b - std::sqrt(q) >= nearest) continue;
    nearest = -b - std::sqrt(q);
    x = o + nearest * d;
    rgb = texture(x.x() + i, x.y() - i, 5);
  }
  return rgb;
}

// A scene's photos, the middle one left out and its camera taken for the view.
World ReadWorld(const std::string& folder, const std::string& proxy) {
  World w;
  ProgressSink& quiet = SilentProgress();
  w.scene = OpenScene(folder, {}, quiet);
  w.proxy = LoadProxy(w.scene, proxy);
  w.photos = LoadPhotos(w.scene, {}, quiet);
  const std::size_t n = w.scene.views.size();
  for (const std::size_t i : {n / 2, n / 4, 3 * n / 4}) {
    const View& view = w.scene.views[i];
    const Camera& camera = w.scene.CameraOf(view);
    // The photo's own shape, as many pixels as the other tables' views.
    const double scale = std::sqrt(static_cast<double>(kWidth) * kHeight / camera.width_px / camera.height_px);
    const Camera scaled = camera.Scaled(static_cast<int>(std::lround(scale * camera.width_px)),
                                        static_cast<int>(std::lround(scale * camera.height_px)));
    TestView t{MakeRenderView(scaled, view.cam_from_world), std::vector<bool>(n, true), {}};
    t.use[i] = false;
    for (const char* silhouettes : {"truth/silhouettes", "silhouettes"}) {
      const auto file = w.scene.folder / silhouettes / (view.name + ".png"),
                 bare = w.scene.folder / silhouettes / std::filesystem::path(view.name).replace_extension(".png");
      for (const auto& mask : {file, bare})
        if (t.mask.empty() && std::filesystem::exists(mask))
          t.mask = Resize(ReadImage8(mask, 3), scaled.width_px, scaled.height_px);
    }
    w.views.push_back(std::move(t));
  }
  w.view = w.views.front().view;
  w.use = w.views.front().use;
  // From behind the middle photo, by a third of the way to what it sees: the photos around it are in this view.
  const View& middle = w.scene.views[n / 2];
  const std::vector<double> depths = PointDepths(w.scene, {static_cast<int>(n / 2)});
  const double back = 0.33 * (depths.empty() ? 1 / w.scene.normalized_from_world.scale : depths[depths.size() / 2]);
  Rigid3 pose = middle.cam_from_world;
  pose.translation.z() += back;
  const Camera& camera = w.scene.CameraOf(middle);
  const double scale = std::sqrt(static_cast<double>(kWidth) * kHeight / camera.width_px / camera.height_px);
  w.behind = {MakeRenderView(camera.Scaled(static_cast<int>(std::lround(scale * camera.width_px)),
                                           static_cast<int>(std::lround(scale * camera.height_px))),
                             pose),
              {},
              {}};
  return w;
}

World MakeWorld(int views, int width) {
  World w;
  const int height = width * 3 / 4;
  w.scene.cameras.push_back(Camera::Pinhole(width, height, 1.1 * width, 1.1 * width, 0.5 * width, 0.5 * height));
  w.proxy.vertices = {{-12, -12, 0}, {12, -12, 0}, {12, 12, 0}, {-12, 12, 0}};
  w.proxy.faces = {{0, 1, 2}, {0, 2, 3}};
  std::mt19937 engine(7);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);
  // A tripod that is raised between shots: short columns of cameras.
  Eigen::Vector3d foot = Eigen::Vector3d::Zero();
  for (int i = 0; i < views; ++i) {
    if (i % 6 == 0) {
      const double a = 0.75 * uniform(engine), b = 0.35 * uniform(engine);
      foot = 4.2 * Eigen::Vector3d(std::sin(a) * std::cos(b), std::sin(b), -std::cos(a) * std::cos(b));
    }
    View v;
    v.name = "view" + std::to_string(1000 + i) + ".png";
    v.camera = {0};
    const Eigen::Vector3d at =
        foot + Eigen::Vector3d(0.02 * normal(engine), 0.12 * (i % 6 - 2.5), 0.02 * normal(engine));
    v.cam_from_world = Looking(at, {0.15 * normal(engine), 0.15 * normal(engine), 0});
    w.scene.views.push_back(v);
    Point p;
    p.x_in_world = {1.5 * uniform(engine), uniform(engine), 0.3 * uniform(engine)};
    w.scene.points.push_back(p);
  }
  UpdateFrameOfReference(w.scene);
  w.view = MakeRenderView(Camera::Pinhole(kWidth, kHeight, 1.9 * kWidth, 1.9 * kWidth, 0.5 * kWidth, 0.5 * kHeight),
                          Looking({1.0, -0.4, -7}, {0.1, 0, 0}));
  w.photos.resize(w.scene.views.size());
  ParallelFor(w.photos.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) {
      const RenderView view = MakeRenderView(w.scene, w.scene.views[j]);
      const Eigen::Matrix3d ray = view.P.leftCols<3>().inverse();
      Image8 image(width, height, 3);
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
          const auto rgb = Shade(view.centre, (ray * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).normalized());
          std::copy(rgb.begin(), rgb.end(), image.Row(y) + 3 * x);
        }
      w.photos[j].levels = BuildPyramid(image);
    }
  });
  return w;
}

RenderRequest Request(const World& w, int k, int grid) {
  RenderRequest r;
  r.view = w.view;
  r.use = w.use;
  r.settings.k = k;
  r.settings.grid_columns = r.settings.grid_rows = grid;
  r.settings.sampling = Sampling::kInterpolated;
  r.settings.visibility = w.proxy.faces.size() > 2;
  return r;
}

double Milliseconds(const std::function<void()>& body) {
  const auto start = std::chrono::steady_clock::now();
  body();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

// Of all threads together: what other programs take does not count.
double CpuMilliseconds(const std::function<void()>& body) {
  const std::clock_t start = std::clock();
  body();
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// The least that a blend of `layers` photos a pixel must do: a homography, a bilinear sample, fixed weights. The same
// inner loops as the renderer's, over whole rows.
void BareLoop(const World& w, const ViewSetup& setup, const PhotoLevels& levels, int layers, ImageF& image) {
  const PhotoMaps maps(setup);
  const LinearD inverse_depth = [&] {
    const Eigen::Vector3d n(0, 0, 1);  // the proxy's plane z = 0
    const Similarity3& s = w.scene.normalized_from_world;
    const Eigen::Vector3d normal = s.rotation * n, point = s * Eigen::Vector3d(0, 0, 0);
    return LinearD((setup.ray_from_pixel.transpose() * normal / normal.dot(point - setup.desired.centre)).transpose());
  }();
  ParallelFor(static_cast<std::size_t>(image.height), 16, [&](std::size_t begin, std::size_t end) {
    LayerBatch b;
    for (std::size_t y = begin; y < end; ++y)
      for (int x = 0; x < image.width; x += kBatch) {
        b.n = std::min(kBatch, image.width - x);
        for (int i = 0; i < b.n; ++i) {
          b.x[i] = static_cast<float>(i);
          b.y[i] = 0;
          b.pixel[i] = static_cast<std::int32_t>(y) * image.width + x + i;
          b.alpha[i] = 1;
        }
        b.Pad();
        b.Clear(false);
        std::fill_n(b.weight, b.padded(), 1.0F / static_cast<float>(layers));
        std::fill_n(b.scale, b.padded(), 1.0F / (255.0F * kWeightOne));
        for (int l = 0; l < layers; ++l) {
          const auto photo = static_cast<std::size_t>(l * 17) % w.photos.size();
          MapToLevel(b, 0, b.n, maps.On(photo, inverse_depth, x, static_cast<int>(y)), levels.level(photo, 0), b.weight,
                     kWeightOne);
          FetchLayer(b, 0, b.n, levels.level(photo, 0));
        }
        StoreColors(b, image.data.data());
      }
  });
}

struct Timing {
  double frame, plan, blend, bare, ratio, cpu_ratio;
  RenderStatistics statistics;
};

// Frame and bare loop by turns, so that what else the machine does meets both; the ratio is the median of the pairs'.
Timing Time(const World& w, const RenderRequest& request, double layers) {
  const auto renderer = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  const ViewSetup setup = MakeViewSetup(MakeSources(w.scene), request.view, request.settings, request.use);
  const PhotoLevels levels(w.photos);
  std::vector<double> frame, plan, blend, bare, ratio, cpu_ratio;
  Timing t{};
  for (int i = -2; i < kRepeats; ++i) {
    double f = 0, low = 0, high = 0;
    const double f_cpu =
        CpuMilliseconds([&] { f = Milliseconds([&] { const ImageF image = renderer->Render(request); }); });
    // Between whole numbers of layers: linear.
    const auto bare_with = [&](int n, double& ms) {
      return CpuMilliseconds([&] {
        ms = Milliseconds([&] {
          ImageF image(kWidth, kHeight, 4);
          BareLoop(w, setup, levels, n, image);
        });
      });
    };
    const int whole = static_cast<int>(layers);
    const double part = layers - whole, low_cpu = bare_with(whole, low), high_cpu = bare_with(whole + 1, high);
    const double b = (1 - part) * low + part * high;
    if (i < 0) continue;
    t.statistics = renderer->Statistics();
    frame.push_back(f);
    bare.push_back(b);
    ratio.push_back(f / b);
    cpu_ratio.push_back(f_cpu / ((1 - part) * low_cpu + part * high_cpu));
    plan.push_back(t.statistics.plan_ms);
    blend.push_back(t.statistics.blend_ms);
  }
  t.frame = Median(frame);
  t.plan = Median(plan);
  t.blend = Median(blend);
  t.bare = Median(bare);
  t.ratio = Median(ratio);
  t.cpu_ratio = Median(cpu_ratio);
  return t;
}

double Psnr(const ImageF& a, const ImageF& b, const Image8& mask) {
  double sum = 0;
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i)
    if (i % 4 != 3 && (mask.empty() || mask.data[i / 4 * 3] > 127)) {
      sum += (a.data[i] - b.data[i]) * (a.data[i] - b.data[i]);
      ++n;
    }
  return sum > 0 ? -10 * std::log10(sum / static_cast<double>(n)) : 99;
}

// Photos a pixel reads, on average.
double LayersAPixel(const World& w, const RenderRequest& request) {
  const ViewSetup setup = MakeViewSetup(MakeSources(w.scene), request.view, request.settings, request.use);
  SparsePlan plan;
  PlanSparse(setup, SparseProxy(w.proxy, w.scene.normalized_from_world), nullptr, ParallelFor, plan);
  double layers = 0, area = 0;
  for (const SparseTriangle& t : plan.triangles) {
    const auto at = [&](std::size_t i) { return plan.x_px[static_cast<std::size_t>(t.vertex[i])]; };
    const Eigen::Vector2f u = at(1) - at(0), v = at(2) - at(0);
    const double a = std::abs(u.x() * v.y() - u.y() * v.x()) / 2;
    layers += a * t.count;
    area += a;
  }
  return layers / area;
}

void TimeTable(const World& w) {
  std::printf(
      "\n## Sparse samples against a bare blending loop\n\nThe loop blends as many layers a pixel; %dx%d, k = 4, 25x25 "
      "samples, interpolated, a plane, 262 photos, %d threads, median of %d.\n\n"
      "| field of view | epipoles | samples | layers a pixel | frame ms | plan ms | blend ms | bare ms | ratio | of "
      "CPU "
      "time |\n|---|---|---|---|---|---|---|---|---|---|\n",
      kWidth, kHeight, kThreads, kRepeats);
  for (const bool fov : {false, true})
    for (const bool epipoles : {false, true}) {
      RenderRequest r = Request(w, 4, 25);
      r.settings.field_of_view = fov;
      r.settings.epipoles = epipoles;
      r.settings.prefilter = false;
      const double layers = LayersAPixel(w, r);
      const Timing t = Time(w, r, layers);
      std::printf("| %s | %s | %ld | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f |\n", fov ? "on" : "off",
                  epipoles ? "on" : "off", t.statistics.samples, layers, t.frame, t.plan, t.blend, t.bare, t.ratio,
                  t.cpu_ratio);
    }
}

// By turns, as above.
void ViewsTable(const World& many) {
  std::printf(
      "\n## Sparse samples by the number of photos\n\nk = 5, 25x25 samples, median of %d pairs.\n\n| epipoles | photos "
      "| "
      "samples | triangles | layers a pixel | plan ms | blend ms | frame ms | ratio "
      "|\n|---|---|---|---|---|---|---|---|---|\n",
      kRepeats);
  const World few = MakeWorld(50, 640);
  for (const bool epipoles : {false, true}) {
    const World* worlds[2] = {&few, &many};
    std::unique_ptr<Renderer> renderers[2];
    RenderRequest requests[2];
    std::vector<double> frame[2], plan[2], blend[2], ratio;
    for (int i = 0; i < 2; ++i) {
      renderers[i] = MakeCpuRenderer(WorldOf(worlds[i]->scene, worlds[i]->proxy), worlds[i]->photos);
      requests[i] = Request(*worlds[i], 5, 25);
      requests[i].settings.epipoles = epipoles;
    }
    for (int repeat = -2; repeat < kRepeats; ++repeat) {
      double ms[2];
      for (int i = 0; i < 2; ++i) {
        ms[i] = Milliseconds([&] { const ImageF image = renderers[i]->Render(requests[i]); });
        if (repeat < 0) continue;
        frame[i].push_back(ms[i]);
        plan[i].push_back(renderers[i]->Statistics().plan_ms);
        blend[i].push_back(renderers[i]->Statistics().blend_ms);
      }
      if (repeat >= 0) ratio.push_back(ms[1] / ms[0]);
    }
    for (int i = 0; i < 2; ++i) {
      const RenderStatistics s = renderers[i]->Statistics();
      std::printf("| %s | %zu | %ld | %ld | %.2f | %.2f | %.2f | %.2f | %s |\n", epipoles ? "on" : "off",
                  worlds[i]->photos.size(), s.samples, s.triangles, LayersAPixel(*worlds[i], requests[i]),
                  Median(plan[i]), Median(blend[i]), Median(frame[i]),
                  i == 0 ? "" : std::to_string(Median(ratio)).substr(0, 4).c_str());
    }
  }
}

void PsnrTable(const World& w, std::vector<TestView> views) {
  const auto renderer = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  if (views.empty()) views.push_back({w.view, w.use, {}});
  const auto request = [&](const TestView& v, int grid) {
    RenderRequest r = Request(w, 4, grid);
    r.view = v.view;
    r.use = v.use;
    return r;
  };
  std::vector<ImageF> exact, exact_false;
  std::vector<double> exact_times;
  for (const TestView& v : views) {
    RenderRequest r = request(v, 0);
    ImageF image = renderer->Render(r);  // makes what is made once
    for (int i = 0; i < 3; ++i) exact_times.push_back(Milliseconds([&] { image = renderer->Render(r); }));
    exact.push_back(std::move(image));
    r.show = Show::kFalseColor;
    exact_false.push_back(renderer->Render(r));
  }
  const double exact_ms = Median(exact_times);
  std::printf(
      "\nAgainst a weight a pixel (%.0f ms a frame), k = 4, %zu photos, proxy of %zu faces, field of view on, worst of "
      "%zu views%s, %d threads. PSNR in dB by samples a side; 99: the same. In brackets that of false colours.\n\n"
      "| sampling | epipoles |",
      exact_ms, w.photos.size(), w.proxy.faces.size(), views.size(),
      views.front().mask.empty() ? "" : ", foreground only", kThreads);
  for (const int grid : kGrids) std::printf(" %d |", grid);
  std::printf(" frame ms at 25 | speed-up at 25 |\n|---|---|%s---|---|\n", "---|---|---|---|---|");
  for (const Sampling sampling : {Sampling::kInterpolated, Sampling::kCandidates})
    for (const bool epipoles : {true, false}) {
      std::printf("| %s | %s |", std::string(Name(sampling)).c_str(), epipoles ? "on" : "off");
      double at_25 = 0;
      for (const int grid : kGrids) {
        double colour = 99, false_colour = 99;
        std::vector<double> ms;
        for (std::size_t v = 0; v < views.size(); ++v) {
          RenderRequest r = request(views[v], grid);
          r.settings.sampling = sampling;
          r.settings.epipoles = epipoles;
          ImageF image;
          for (int i = 0; i < 5; ++i) ms.push_back(Milliseconds([&] { image = renderer->Render(r); }));
          colour = std::min(colour, Psnr(image, exact[v], views[v].mask));
          r.show = Show::kFalseColor;
          false_colour = std::min(false_colour, Psnr(renderer->Render(r), exact_false[v], views[v].mask));
        }
        if (grid == 25) at_25 = Median(ms);
        std::printf(" %.1f (%.1f) |", colour, false_colour);
      }
      std::printf(" %.1f | %.1f |\n", at_25, exact_ms / at_25);
    }
}

// For a profiler: one way only.
void Repeat(const World& w, Sampling sampling) {
  const auto renderer = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  RenderRequest r = Request(w, 4, 25);
  r.settings.sampling = sampling;
  std::vector<double> ms, plan, cpu;
  for (int i = 0; i < 60; ++i) {
    cpu.push_back(
        CpuMilliseconds([&] { ms.push_back(Milliseconds([&] { const ImageF image = renderer->Render(r); })); }));
    plan.push_back(renderer->Statistics().plan_ms);
  }
  std::printf("%s 25x25: frame %.2f ms, plan %.2f ms, %.2f ms of CPU time\n", std::string(Name(sampling)).c_str(),
              Median(ms), Median(plan), Median(cpu));
}

void Pictures(const World& w, const std::string& folder) {
  const auto renderer = MakeCpuRenderer(WorldOf(w.scene, w.proxy), w.photos);
  for (const auto& [name, show] : {std::pair("color", Show::kColor), std::pair("false-color", Show::kFalseColor),
                                   std::pair("tessellation", Show::kTessellation)})
    for (const int sampling : {0, 1, 2}) {
      RenderRequest r = Request(w, 4, sampling == 0 ? 0 : 25);
      r.settings.sampling = sampling == 2 ? Sampling::kCandidates : Sampling::kInterpolated;
      r.show = show;
      WriteImage(folder + "/" + name + "-" +
                     (sampling == 0   ? "pixel"
                      : sampling == 1 ? "interpolated"
                                      : "candidates") +
                     ".png",
                 ToRgba8(renderer->Render(r)));
    }
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  std::vector<std::string> what(argv + 1, argv + argc);
  const auto wanted = [&](const char* name) {
    return what.empty() || std::find(what.begin(), what.end(), name) != what.end();
  };
  lumi::SetThreadCount(lumi::kThreads);
  const auto scene = std::find(what.begin(), what.end(), "--scene");
  const auto proxy = std::find(what.begin(), what.end(), "--proxy");
  const lumi::World world =
      scene != what.end() && scene + 1 != what.end()
          ? lumi::ReadWorld(scene[1], proxy != what.end() && proxy + 1 != what.end() ? proxy[1] : "")
          : lumi::MakeWorld(262, 640);
  if (wanted("time")) lumi::TimeTable(world);
  if (wanted("views")) lumi::ViewsTable(world);
  const auto titled = std::find(what.begin(), what.end(), "--title");
  const std::string title = titled != what.end() && titled + 1 != what.end() ? titled[1] : "262 photos";
  if (wanted("psnr")) {
    std::printf("\n## Sparse samples against a weight a pixel: %s\n", title.c_str());
    lumi::PsnrTable(world, world.views);
  }
  if (wanted("psnr") && !world.views.empty()) {
    std::printf("\n### A view with epipoles in it, from behind the photos: %s\n", title.c_str());
    lumi::PsnrTable(world, {world.behind});
  }
  for (const lumi::Sampling sampling : {lumi::Sampling::kInterpolated, lumi::Sampling::kCandidates})
    if (!what.empty() && wanted(std::string(Name(sampling)).c_str())) lumi::Repeat(world, sampling);
  if (const auto at = std::find(what.begin(), what.end(), "--pictures"); at != what.end() && at + 1 != what.end())
    lumi::Pictures(world, at[1]);
  return 0;
}
