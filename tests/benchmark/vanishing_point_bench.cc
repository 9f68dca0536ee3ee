// Angles by vanishing points against true ones (thesis sec. 6.2.1, Fig. 6-3) on a metric scene: how far weights are
// apart where the calibration is nominal and the plane at infinity a guess, and how far radiance consistency is lost:
// weights of one ray in virtual views that are turned or zoomed.
//
//   vanishing_point_bench SCENE [--proxy NAME] [--width W] [-o FOLDER]    FOLDER: metric.png, vanishing-points.png,
//   difference.png
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "render/photos/photo_set.h"
#include "render/picture/convert.h"
#include "render/radiance/frame_plan.h"
#include "render/world/renderer.h"
#include "render/world/vanishing_point.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/median.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"

namespace {

using namespace lumi;

constexpr float kExaggerated = 8;  // differences in difference.png

// The scene as one view's vanishing points have it.
struct World {
  Sources sources;
  Mesh proxy;
  RenderView view;
  VanishingPointFrame frame;
};

World WorldOf(const Scene& scene, const Mesh& proxy, const RenderView& view, const Plane& plane,
              double nominal_focal_px, double depth) {
  auto frame =
      VanishingPointFrame::Make(view.P, plane, NominalCalibration(view.size_px, nominal_focal_px), plane.w() / depth);
  if (!frame) throw DataError("the view's centre lies on the plane at infinity");
  World w{{}, proxy, view, *frame};
  w.view.P = frame->P();
  w.view.centre.setZero();
  for (const View& v : scene.views) {
    RenderView source = MakeRenderView(scene, v);
    const auto moved = frame->MoveCamera(source.P);
    if (!moved) throw DataError("a photo's centre lies beyond the plane at infinity: " + v.name);
    source.P = moved->P;
    source.centre = moved->centre;
    w.sources.views.push_back(source);
  }
  for (Eigen::Vector3d& x : w.proxy.vertices) {
    const Eigen::Vector4d moved = frame->MovePoint(x.homogeneous());
    x = moved.head<3>() / moved.w();
  }
  return w;
}

// Weights of all photos for one ray to a point.
std::vector<double> Weights(const RelativeSources& sources, const Eigen::Vector3d& to, const RadianceSettings& settings,
                            WeighScratch& scratch) {
  const RayWeights r = Weigh({sources, nullptr, settings}, {to.normalized(), to.norm()}, scratch);
  std::vector<double> w(static_cast<std::size_t>(sources.count), 0.0);
  for (std::size_t i = 0; i < static_cast<std::size_t>(r.count); ++i)
    w[static_cast<std::size_t>(r.camera[i])] = static_cast<double>(r.weight[i]);
  return w;
}

// Half the sum of differences: the share of a colour that comes from other photos.
double Moved(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
  return 0.5 * sum;
}

struct Spread {
  double mean = 0, p95 = 0;
};
Spread SpreadOf(std::vector<double> values) {
  Spread s;
  for (const double v : values) s.mean += v / static_cast<double>(std::max<std::size_t>(1, values.size()));
  std::sort(values.begin(), values.end());
  if (!values.empty()) s.p95 = values[static_cast<std::size_t>(0.95 * static_cast<double>(values.size() - 1))];
  return s;
}

class Bench {
 public:
  Bench(const std::filesystem::path& folder, const std::string& proxy, int width) {
    OpenOptions open;
    scene_ = OpenScene(folder, open, SilentProgress());
    RequireMetric(scene_, "the comparison");
    proxy_ = LoadProxy(scene_, proxy);
    // Behind the middle photo and to the side, where rays of many photos come together.
    const View& near = scene_.views[scene_.views.size() / 2];
    depth_ = Median(PointDepths(scene_, {static_cast<std::int32_t>(scene_.views.size() / 2)}));
    pose_ = near.cam_from_world;
    pose_.translation += depth_ * Eigen::Vector3d(0.1, 0.05, 0.5);
    camera_ = scene_.CameraOf(near).Scaled(
        width, std::max(1, static_cast<int>(std::lround(static_cast<double>(width) * scene_.CameraOf(near).height_px /
                                                        scene_.CameraOf(near).width_px))));
    view_ = MakeRenderView(camera_, pose_);
    settings_.visibility = false;
  }

  // Rays of the view to the proxy, in world.
  std::vector<Eigen::Vector3d> Points() const {
    const ProxyTracer tracer(proxy_, scene_.normalized_from_world);
    const ViewSetup setup = MakeViewSetup(MakeSources(scene_), view_, settings_);
    std::vector<Eigen::Vector3f> d;
    for (int y = 2; y < view_.size_px.y(); y += 4)
      for (int x = 2; x < view_.size_px.x(); x += 4)
        d.push_back((setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).normalized().cast<float>());
    std::vector<float> t(d.size());
    tracer.Trace(setup.desired.centre.cast<float>(), d, t);
    const Similarity3 world = scene_.normalized_from_world.Inverse();
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < d.size(); ++i)
      if (std::isfinite(t[i]))
        points.push_back(world *
                         Eigen::Vector3d(setup.desired.centre + static_cast<double>(t[i]) * d[i].cast<double>()));
    return points;
  }

  std::vector<std::vector<double>> Metric(const RenderView& view, const std::vector<Eigen::Vector3d>& points) const {
    const Sources sources = MakeSources(scene_);
    const RenderView desired = Normalized(view, scene_.normalized_from_world);
    const RelativeSources relative = MakeRelative(sources, desired, {}, settings_.fov_feather);
    WeighScratch scratch;
    std::vector<std::vector<double>> weights;
    for (const Eigen::Vector3d& p : points)
      weights.push_back(Weights(relative, scene_.normalized_from_world * p - desired.centre, settings_, scratch));
    return weights;
  }
  std::vector<std::vector<double>> Vanishing(const RenderView& view, const Plane& plane, double nominal_focal_px,
                                             const std::vector<Eigen::Vector3d>& points) const {
    const World w = WorldOf(scene_, {}, view, plane, nominal_focal_px, depth_);
    const RelativeSources relative = MakeRelative(w.sources, w.view, {}, settings_.fov_feather);
    WeighScratch scratch;
    std::vector<std::vector<double>> weights;
    for (const Eigen::Vector3d& p : points) {
      const Eigen::Vector4d moved = w.frame.MovePoint(p.homogeneous());
      weights.push_back(Weights(relative, moved.head<3>() / moved.w(), settings_, scratch));
    }
    return weights;
  }
  static Spread Compare(const std::vector<std::vector<double>>& a, const std::vector<std::vector<double>>& b) {
    std::vector<double> moved;
    for (std::size_t i = 0; i < a.size(); ++i) moved.push_back(Moved(a[i], b[i]));
    return SpreadOf(moved);
  }

  // `tilt`: of the plane at infinity, so that the inverse depth of the scene's middle is wrong by this share at one
  // depth to the side.
  Plane Guess(double tilt) const {
    Plane plane(0, 0, 0, 1);
    const Eigen::Vector3d side = pose_.R().row(0) + pose_.R().row(2);
    plane.head<3>() = tilt / depth_ * side.normalized();
    plane.w() = 1 - plane.head<3>().dot(view_.centre);
    return plane;
  }

  void Angles(const std::filesystem::path& out) {
    const std::vector<Eigen::Vector3d> points = Points();
    const auto truth = Metric(view_, points);
    std::printf("%-52s %12s %12s %14s\n", "weights against those of true angles", "mean moved", "95 % moved",
                "picture dB");
    const std::vector<Photo> photos = LoadPhotos(scene_, {}, SilentProgress());
    const auto metric = MakeCpuRenderer(lumi::WorldOf(scene_, proxy_), photos);
    RenderRequest request;
    request.view = view_;
    request.settings = settings_;
    const Image8 picture = ToRgb8(metric->Render(request));
    request.show = Show::kFalseColor;
    const Image8 colors = ToRgb8(metric->Render(request));
    struct Row {
      std::string name;
      double focal, tilt;
    };
    for (const Row& row :
         {Row{"true plane, true focal length", 1, 0}, Row{"true plane, nominal focal length x 0.5", 0.5, 0},
          Row{"true plane, x 0.8", 0.8, 0}, Row{"true plane, x 1.25", 1.25, 0}, Row{"true plane, x 2", 2, 0},
          Row{"plane tilted by 0.1, true focal length", 1, 0.1}, Row{"plane tilted by 0.3, x 0.8", 0.8, 0.3}}) {
      const double focal = row.focal * camera_.FocalPx().x();
      const Spread s = Compare(truth, Vanishing(view_, Guess(row.tilt), focal, points));
      World w = WorldOf(scene_, proxy_, view_, Guess(row.tilt), focal, depth_);
      PictureWorld there = *lumi::WorldOf(scene_, w.proxy);
      there.sources = w.sources;
      there.occlusion = false;
      metric->Enter(std::make_shared<const PictureWorld>(std::move(there)));
      RenderRequest own = request;
      own.view = w.view;
      own.show = Show::kColor;
      const double db = lumi::Compare(ToRgb8(metric->Render(own)), picture).psnr_db;
      std::printf("%-52s %11.2f%% %11.2f%% %14.1f\n", row.name.c_str(), 100 * s.mean, 100 * s.p95, db);
      if (out.empty() || row.focal != 0.8 || row.tilt != 0) continue;
      own.show = Show::kFalseColor;
      const Image8 vanishing = ToRgb8(metric->Render(own));
      Image8 difference(colors.width, colors.height, 3);
      for (std::size_t i = 0; i < difference.data.size(); ++i)
        difference.data[i] = static_cast<std::uint8_t>(std::clamp(
            kExaggerated * std::abs(static_cast<float>(colors.data[i]) - static_cast<float>(vanishing.data[i])), 0.0F,
            255.0F));
      std::filesystem::create_directories(out);
      WriteImage(out / "metric.png", colors);
      WriteImage(out / "vanishing-points.png", vanishing);
      WriteImage(out / "difference.png", difference);
    }
  }

  // The same rays in views of the same centre.
  void Consistency() {
    const std::vector<Eigen::Vector3d> points = Points();
    std::printf("\n%-52s %16s %16s %16s %16s\n", "weights of one ray, against the view's own: mean, 95 %",
                "true angles", "nominal = true", "nominal x 0.8", "nominal x 2");
    const auto turned = [&](double degrees, double zoom) {
      Rigid3 pose = pose_;
      const Eigen::Vector3d centre = pose.OriginInSource();
      pose.rotation =
          Eigen::Quaterniond(Eigen::AngleAxisd(degrees * kRadPerDeg, Eigen::Vector3d::UnitY())) * pose.rotation;
      pose.translation = -(pose.rotation * centre);
      const Eigen::Vector2d f = zoom * camera_.FocalPx();
      return MakeRenderView(Camera::Pinhole(camera_.width_px, camera_.height_px, f.x(), f.y(), 0.5 * camera_.width_px,
                                            0.5 * camera_.height_px),
                            pose);
    };
    const double focal = camera_.FocalPx().x();
    const RenderView straight = turned(0, 1);
    const auto metric = Metric(straight, points);
    const std::vector<double> nominal = {1, 0.8, 2};
    std::vector<std::vector<std::vector<double>>> own;
    for (const double n : nominal) own.push_back(Vanishing(straight, Guess(0), n * focal, points));
    for (const auto& [name, degrees, zoom] : {std::tuple("turned by 5 degrees", 5.0, 1.0),
                                              {"turned by 10 degrees", 10.0, 1.0},
                                              {"turned by 20 degrees", 20.0, 1.0},
                                              {"zoomed by 1.25", 0.0, 1.25},
                                              {"zoomed by 2", 0.0, 2.0}}) {
      const RenderView view = turned(degrees, zoom);
      std::string line = fmt::format("{:<52}", name);
      const auto add = [&](const Spread& s) { line += fmt::format(" {:>7.2f}% {:>6.2f}%", 100 * s.mean, 100 * s.p95); };
      add(Compare(metric, Metric(view, points)));
      for (std::size_t i = 0; i < nominal.size(); ++i)
        add(Compare(own[i], Vanishing(view, Guess(0), nominal[i] * focal, points)));
      std::printf("%s\n", line.c_str());
    }
  }

 private:
  Scene scene_;
  Mesh proxy_;
  double depth_ = 1;
  Rigid3 pose_;
  Camera camera_;
  RenderView view_;
  RadianceSettings settings_;
};

}  // namespace

int main(int argc, char** argv) {
  std::string scene, proxy, out;
  int width = 640;
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    if (a == "--proxy" && i + 1 < argc)
      proxy = argv[++i];
    else if (a == "--width" && i + 1 < argc)
      width = std::stoi(argv[++i]);
    else if (a == "-o" && i + 1 < argc)
      out = argv[++i];
    else
      scene = a;
  }
  try {
    Bench bench(scene, proxy, width);
    bench.Angles(out);
    bench.Consistency();
  } catch (const lumi::Error& e) {
    std::fprintf(stderr, "vanishing_point_bench: %s\n", e.what());
    return static_cast<int>(e.code());
  }
  return 0;
}
