#include "render/render_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "render/convert.h"
#include "render/effects/effects.h"
#include "render/effects/exposure.h"
#include "render/holdout.h"
#include "render/output_name.h"
#include "render/path/camera_path.h"
#include "render/settings_json.h"
#include "render/show/camera_configuration.h"
#include "render/show/measure_map.h"
#include "render/tradeoff/budget.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/video.h"
#include "scene/geometry/median.h"
#include "scene/image_difference/image_difference.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr int kDefaultPathWidth = 1024;
constexpr int kConfigurationSide = 640;  // of each of the panels of --show cameras
constexpr const char* kMarker = "render.json";  // what makes an output folder ours

double Milliseconds(Clock::time_point since) { return std::chrono::duration<double, std::milli>(Clock::now() - since).count(); }

void RequireConsistent(const RenderOptions& o) {
  if (const std::string problem = Validate(o.settings); !problem.empty()) throw UsageError(problem);
  if (o.backend == "gl" && !o.budget_ms) RequireDrawnByGl(o.settings);
  if (o.budget_ms && !(*o.budget_ms > 0 && std::isfinite(*o.budget_ms))) throw UsageError("--budget-ms must be above 0");
  if (o.holdout != 0 && o.holdout < 2) throw UsageError("--holdout takes 2 or more");
  if (o.holdout != 0 && !o.view.empty()) throw UsageError("--holdout and --view do not go together");
  if (!o.path.empty() && (o.holdout != 0 || !o.view.empty())) throw UsageError("--path goes with neither --holdout nor --view");
  if (o.show == "cameras" && o.view.empty() && o.path.empty()) throw UsageError("--show cameras needs --view or --path: the virtual view that is drawn among them");
  if (!o.of.empty() && !MeasureFromName(o.show)) throw UsageError("--of goes with --show weights, angle, fov, resolution, visibility, time or dissimilarity");
  if (o.holdout != 0 && o.show != "color") throw UsageError("--holdout compares colours: --show does not go with it");
  if (o.show == "difference" && o.view.empty()) throw UsageError("--show difference needs --view: the photo to compare with");
  if (o.leave_out && o.view.empty()) throw UsageError("--leave-out goes with --view");
  if (o.width_px < 0 || o.height_px < 0 || o.width_px > kMaxPictureSide || o.height_px > kMaxPictureSide)
    throw UsageError("--width and --height take 1 to " + std::to_string(kMaxPictureSide));
  if (!(o.seconds > 0 && o.seconds <= 3600) || !(o.fps > 0 && o.fps <= 240)) throw UsageError("--seconds takes up to 3600, --fps up to 240");
}

class Job {
 public:
  Job(const RenderOptions& options, ProgressSink& sink) : o_(options), sink_(sink), settings_(options.settings), decided_(options.decided) {
    RequireConsistent(o_);
    ApplyEffectList(o_.effects, settings_, decided_);
    if (o_.output.empty() && o_.holdout == 0) throw UsageError("-o says where the pictures go");
    const bool to_video = o_.output.extension() == ".mp4";
    if (to_video && (o_.holdout != 0 || !o_.view.empty())) throw UsageError("a video needs a path, not --view or --holdout");
    if (!o_.output.empty() && !to_video) RequireOurFolder(o_.output, kMarker);
    OpenOptions open;
    open.rescale_cameras = o_.rescale_cameras;
    scene_ = OpenScene(o_.scene, open, sink_);
    RequireMetric(scene_, "rendering");
    if (scene_.views.empty()) throw DataError("the scene has no photos with cameras", "", o_.scene);
    mesh_ = LoadProxy(scene_, o_.proxy);
    if (!o_.view.empty()) view_ = ViewCalled(o_.view);
    ApplyTime();
    photos_ = LoadPhotos(scene_, {}, sink_);
    double gain_spread = 1;
    if (decided_.count("exposure") == 0 || settings_.exposure) {
      const Exposures exposures = EstimateExposures(scene_, photos_);
      if (exposures.Differ()) gain_spread = exposures.spread;
      for (std::size_t i = 0; i < scene_.views.size(); ++i) scene_.views[i].gain = exposures.gain[i];
    }
    std::vector<bool> use;
    const std::vector<RenderView> desired = DesiredViews(use);
    choice_ = ChooseEffects(scene_, mesh_, desired, use, settings_, decided_, gain_spread);
    settings_ = choice_.settings;
    renderer_ = o_.backend == "gl" ? MakeGlRenderer(scene_, mesh_, photos_) : MakeCpuRenderer(scene_, mesh_, photos_);
  }

  std::string Run() {
    std::vector<bool> use;
    const RenderView first = DesiredViews(use).front();
    MeasureEffects(*renderer_, first, use, choice_);
    KeepBudget(first, use);
    Json j = o_.holdout != 0 ? Holdout() : !o_.view.empty() ? OneView() : Path();
    j["proxy"] = o_.proxy.empty() ? scene_.active_proxy : o_.proxy;
    j["device"] = renderer_->Device();
    j["settings"] = SettingsJson();
    if (budget_) j["budget"] = Budget();
    if (!scale_.is_null()) j["scale"] = scale_;
    j["effects"] = Json::array();
    for (const Effect& e : choice_.effects) j["effects"].push_back({{"name", e.name}, {"on", e.on}, {"evidence", e.evidence}, {"cost_ms", e.cost_ms}});
    const RenderStatistics statistics = renderer_->Statistics();
    if (statistics.samples > 0) j["samples"] = statistics.samples;
    if (settings_.similarity == Similarity::kFull)
      j["optimum"] = {{"samples", statistics.optimum.samples},
                      {"cameras_mean", statistics.optimum.samples > 0 ? static_cast<double>(statistics.optimum.cameras) / static_cast<double>(statistics.optimum.samples) : 0},
                      {"dense", statistics.optimum.dense},
                      {"nugget_raised", statistics.optimum.nugget_raised},
                      {"indefinite", statistics.optimum.indefinite},
                      {"small_sums", statistics.optimum.small_sums}};
    if (settings_.similarity == Similarity::kFull && 2 * statistics.optimum.small_sums > statistics.optimum.samples)
      sink_.Message(fmt::format("at {:.0f} % of the samples no photo correlates with the ray: they stand farther apart than 2 x --r-max-deg, and the "
                                "optimum falls back to the local mean; a larger --r-max-deg gives it something to say",
                                100.0 * static_cast<double>(statistics.optimum.small_sums) / static_cast<double>(statistics.optimum.samples)));
    if (!o_.output.empty() && o_.output.extension() != ".mp4") WriteTextAtomically(o_.output / kMarker, j.dump(2) + "\n");
    return j.dump();
  }

 private:
  Json SettingsJson() const {
    Json j = ToJson(settings_);
    j["backend"] = o_.backend;
    return j;
  }

  Json Budget() const {
    Json j = {{"budget_ms", *o_.budget_ms}};
    j.update(ToJson(*budget_));
    return j;
  }

  // --budget-ms: the settings for frames like this one. What the user decided stays.
  void KeepBudget(RenderView first, const std::vector<bool>& use) {
    if (!o_.budget_ms) return;
    if (o_.holdout != 0 && o_.width_px > 0 && o_.width_px < first.size_px.x()) {
      const double share = static_cast<double>(o_.width_px) / first.size_px.x();
      first.P.topRows<2>() *= share;
      first.size_px = {o_.width_px, std::max(1, static_cast<int>(std::lround(share * first.size_px.y())))};
    }
    RenderRequest request;
    request.view = first;
    request.settings = settings_;
    request.use = use;
    FixedOptions fixed;
    const Json now = ToJson(settings_);
    for (const std::string& name : decided_)
      if (now.contains(name)) fixed.emplace_back(name, now[name].is_string() ? now[name].get<std::string>() : now[name].dump());
    budget_ = ChooseForBudget(scene_.folder, o_.backend, o_.proxy.empty() ? scene_.active_proxy : o_.proxy, *renderer_, request, fixed, *o_.budget_ms);
    settings_ = budget_->settings;
    for (Effect& e : choice_.effects)
      if (const bool on = settings_.resolution != Resolution::kOff; e.name == "resolution" && e.on != on) {
        e.on = on;
        e.evidence = "chosen with the budget";
      }
  }

  // A time was asked for, or the scene has a period.
  void ApplyTime() {
    settings_.period_s = scene_.period_s.value_or(0);
    if (!o_.phase) return;
    if (!(settings_.period_s > 0)) throw DataError("the scene has no period, so that --phase says nothing", "use --time-s", o_.scene);
    settings_.time_s = *o_.phase * settings_.period_s;
  }

  // What will be rendered, and from which photos.
  std::vector<RenderView> DesiredViews(std::vector<bool>& use) const {
    std::vector<RenderView> desired;
    if (o_.holdout != 0) {
      use.assign(scene_.views.size(), true);
      for (const ViewId id : FoldViews(scene_, o_.holdout, o_.fold == "choose" ? Fold::kChoose : Fold::kReport)) {
        use[static_cast<std::size_t>(id.value)] = false;
        desired.push_back(MakeRenderView(scene_, scene_.views[static_cast<std::size_t>(id.value)]));
      }
      if (std::none_of(use.begin(), use.end(), [](bool u) { return u; })) use.clear();
    } else if (!o_.view.empty()) {
      desired.push_back(RequestedView());
      if (o_.leave_out) {
        use.assign(scene_.views.size(), true);
        use[static_cast<std::size_t>(view_)] = false;
      }
    } else {
      desired = PathViews(RequestedPath());
    }
    return desired;
  }

  Show ShowMode() const {
    return o_.show == "false-color" ? Show::kFalseColor : o_.show == "tessellation" ? Show::kTessellation : Show::kColor;
  }

  int ViewCalled(const std::string& name) const {
    for (std::size_t i = 0; i < scene_.views.size(); ++i)
      if (scene_.views[i].name == name || OutputName(scene_.views[i].name) == name) return static_cast<int>(i);
    throw UsageError("no photo is called " + name, "the first is " + scene_.views.front().name);
  }

  ImageF Picture(const RenderRequest& request) {
    const auto measure = MeasureFromName(o_.show);
    if (!measure) return renderer_->Render(request);
    MeasureMap map = RenderMeasureMap(scene_, mesh_, request, *measure, o_.of.empty() ? -1 : ViewCalled(o_.of));
    scale_ = {{"measure", o_.show}, {"low", map.low}, {"high", map.high}, {"unit", map.unit}};
    return std::move(map.image);
  }

  void Write(const std::filesystem::path& stem, const ImageF& image) const {
    const std::filesystem::path file = stem.string() + "." + o_.format;
    if (o_.format == "exr")
      WriteImage(file, image);
    else if (o_.format == "jpg")
      WriteImage(file, ToRgb8(image));
    else
      WriteImage(file, ToRgba8(image));
  }

  Json Holdout() {
    HoldoutOptions h;
    h.n = o_.holdout;
    h.fold = o_.fold == "choose" ? Fold::kChoose : Fold::kReport;
    h.width_px = o_.width_px;
    h.settings = settings_;
    h.folder = o_.output;
    const HoldoutSummary s = EvaluateHoldout(scene_, *renderer_, h, sink_);
    Json views = Json::array();
    for (const HoldoutView& v : s.views)
      views.push_back({{"name", v.name}, {"psnr_db", v.psnr_db}, {"ssim", v.ssim}, {"coverage", v.coverage},
                       {"nearest_photo", v.nearest_name}, {"nearest_photo_psnr_db", v.nearest_psnr_db},
                       {"nearest_photo_ssim", v.nearest_ssim}, {"nearest_photo_coverage", v.nearest_coverage}, {"ms", v.ms},
                       {"file", OutputName(v.name)}});
    return {{"frames", s.views.size()},
            {"ms_per_frame", s.ms_per_frame},
            {"coverage", s.coverage_mean},
            {"holdout", o_.holdout},
            {"fold", o_.fold},
            {"psnr_mean_db", s.psnr_mean_db},
            {"ssim_mean", s.ssim_mean},
            {"nearest_photo_psnr_mean_db", s.nearest_psnr_mean_db},
            {"nearest_photo_ssim_mean", s.nearest_ssim_mean},
            {"nearest_photo_coverage_mean", s.nearest_coverage_mean},
            {"views", views}};
  }

  // The camera of --view, at the size that is wanted.
  RenderView RequestedView() const {
    const View& view = scene_.views[static_cast<std::size_t>(view_)];
    Camera camera = scene_.CameraOf(view);
    if (o_.width_px > 0 || o_.height_px > 0) {
      const double aspect = static_cast<double>(camera.height_px) / camera.width_px;
      const int width = o_.width_px > 0 ? o_.width_px : static_cast<int>(std::lround(o_.height_px / aspect));
      const int height = o_.height_px > 0 ? o_.height_px : static_cast<int>(std::lround(width * aspect));
      camera = camera.Scaled(std::max(1, width), std::max(1, height));
    }
    RenderView desired = MakeRenderView(camera, view.cam_from_world);
    desired.time_s = view.time_s;
    desired.gain = view.gain;
    return desired;
  }

  CameraPath RequestedPath() const { return o_.path.empty() ? PathThroughPhotos(scene_, o_.seconds, o_.fps) : ReadCameraPath(o_.path); }

  std::vector<RenderView> PathViews(const CameraPath& path) const {
    const Camera& first = scene_.CameraOf(scene_.views.front());
    int width = o_.width_px > 0 ? o_.width_px : path.width_px > 0 ? path.width_px : 0;
    int height = o_.height_px > 0 ? o_.height_px : path.height_px > 0 && o_.width_px == 0 ? path.height_px : 0;
    const double aspect = static_cast<double>(first.height_px) / first.width_px;
    if (width == 0) width = height > 0 ? static_cast<int>(std::lround(height / aspect)) : std::min(kDefaultPathWidth, first.width_px);
    if (height == 0) height = static_cast<int>(std::lround(width * aspect));
    return SamplePath(path, width, height);
  }

  Json OneView() {
    const View& view = scene_.views[static_cast<std::size_t>(view_)];
    RenderRequest request;
    request.view = RequestedView();
    request.settings = settings_;
    request.show = ShowMode();
    if (o_.leave_out) {
      request.use.assign(scene_.views.size(), true);
      request.use[static_cast<std::size_t>(view_)] = false;
    }
    const auto start = Clock::now();
    const ImageF image = Picture(request);
    const double ms = Milliseconds(start);
    Image8 photo = ReadImage8(scene_.ImagePath(view), 3);
    if (photo.width != image.width || photo.height != image.height) photo = Resize(photo, image.width, image.height);
    const Image8 rendered = ToRgb8(image);
    const ImageDifference d = Compare(rendered, photo);
    const std::filesystem::path stem = o_.output / OutputName(view.name);
    if (o_.show == "cameras")
      WriteImage(stem.string() + (o_.format == "jpg" ? ".jpg" : ".png"), DrawCameraConfiguration(scene_, mesh_, request.view, kConfigurationSide));
    else if (o_.show == "difference")
      WriteImage(stem.string() + (o_.format == "jpg" ? ".jpg" : ".png"), DifferenceImage(rendered, photo));
    else
      Write(stem, image);
    return {{"frames", 1}, {"ms_per_frame", ms}, {"coverage", Coverage(image)},
            {"views", Json::array({{{"name", view.name}, {"psnr_db", d.psnr_db}, {"ssim", d.ssim}, {"mean_absolute_difference", d.mean_absolute},
                                    {"mean_absolute_difference_seen", SeenDifference(image, photo)}, {"coverage", Coverage(image)}}})}};
  }

  static ImageF Opaque(const Image8& rgb) {
    ImageF image(rgb.width, rgb.height, 4, 1.0F);
    for (int y = 0; y < rgb.height; ++y)
      for (int x = 0; x < rgb.width; ++x)
        for (int c = 0; c < 3; ++c) image.At(x, y, c) = static_cast<float>(rgb.At(x, y, c)) / 255.0F;
    return image;
  }

  // Mean absolute difference (code values) over the pixels where anything is seen: is a photo given back at its camera?
  static double SeenDifference(const ImageF& image, const Image8& photo) {
    double sum = 0, n = 0;
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        const float alpha = image.At(x, y, 3);
        if (!(alpha > 0)) continue;
        for (int c = 0; c < 3; ++c) sum += std::abs(255.0 * image.At(x, y, c) / alpha - photo.At(x, y, c));
        n += 3;
      }
    return n > 0 ? sum / n : 0;
  }

  Json Path() {
    const CameraPath path = RequestedPath();
    const std::vector<RenderView> views = PathViews(path);
    const int width = views.front().size_px.x(), height = views.front().size_px.y();

    const bool only_video = o_.output.extension() == ".mp4";
    const std::filesystem::path frames_folder = only_video ? std::filesystem::path() : o_.output / "frames";
    // Frames that an earlier run with the same scene, path and settings finished are kept.
    const std::string wanted = FrameFingerprint(path, width, height);
    if (!only_video) {
      std::error_code ec;
      const std::filesystem::path stamp = frames_folder / "frames.txt";
      if (!std::filesystem::exists(stamp) || ReadText(stamp) != wanted) {
        std::filesystem::remove_all(frames_folder, ec);
        std::filesystem::create_directories(frames_folder);
        // The marker first: an interrupted run's folder is ours too.
        WriteTextAtomically(o_.output / kMarker, "{}\n");
        WriteTextAtomically(stamp, wanted);
      }
    }
    std::optional<VideoWriter> video;
    if (only_video) video.emplace(o_.output, path.fps);
    if (!only_video && o_.video) video.emplace(o_.output / "path.mp4", path.fps);

    Progress progress(sink_, "rendering frames", static_cast<long>(views.size()));
    std::vector<double> times;
    double coverage = 0;
    long rendered = 0, reused = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const std::filesystem::path stem = frames_folder / fmt::format("frame_{:06}", i);
      const std::filesystem::path file = stem.string() + "." + o_.format;
      if (!only_video && std::filesystem::exists(file)) {
        ++reused;
        if (video) video->Add(ReadImage8(file, 3));
        progress.Step();
        continue;
      }
      RenderRequest request;
      request.view = views[i];
      request.settings = settings_;
      request.show = ShowMode();
      const auto start = Clock::now();
      const ImageF image = o_.show == "cameras" ? Opaque(DrawCameraConfiguration(scene_, mesh_, request.view, kConfigurationSide)) : Picture(request);
      times.push_back(Milliseconds(start));
      coverage += Coverage(image);
      ++rendered;
      if (!only_video) Write(stem, image);
      if (video) video->Add(ToRgb8(image));
      progress.Step();
    }
    if (video) video->Finish();
    Json j = {{"frames", views.size()}, {"frames_reused", reused}, {"ms_per_frame", Median(times)}, {"width", width}, {"height", height}};
    j["coverage"] = rendered > 0 ? Json(coverage / static_cast<double>(rendered)) : Json(nullptr);
    if (video) j["video"] = (only_video ? o_.output : o_.output / "path.mp4").generic_string();
    return j;
  }

  std::string FrameFingerprint(const CameraPath& path, int width, int height) const {
    Json j = {{"settings", SettingsJson()}, {"show", o_.show}, {"width", width}, {"height", height},
              {"scene", Fingerprint(scene_.folder / "sparse")}, {"manifest", Fingerprint(scene_.folder / "lumigraph.json")}};
    j["proxy"] = Fingerprint(ProxyPath(scene_.folder, o_.proxy.empty() ? scene_.active_proxy : o_.proxy));
    j["fps"] = path.fps;
    for (const PathKey& key : path.keys) {
      const auto& q = key.cam_from_world.rotation.coeffs();
      const auto& t = key.cam_from_world.translation;
      j["keys"].push_back({key.time_s, key.vertical_fov_rad, q[0], q[1], q[2], q[3], t[0], t[1], t[2]});
    }
    return j.dump() + "\n";
  }

  const RenderOptions& o_;
  ProgressSink& sink_;
  RadianceSettings settings_;
  std::optional<BudgetChoice> budget_;
  std::set<std::string> decided_;
  EffectChoice choice_;
  Json scale_;
  Scene scene_;
  Mesh mesh_;
  int view_ = -1;
  std::vector<Photo> photos_;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace

const std::vector<std::string>& ShowNames() {
  static const std::vector<std::string> names = {"color", "false-color", "tessellation", "weights", "angle", "fov", "resolution",
                                                 "visibility", "time", "dissimilarity", "difference", "cameras"};
  return names;
}

std::string RunRender(const RenderOptions& options, ProgressSink& progress) { return Job(options, progress).Run(); }

std::string DescribeRender(const std::string& json) {
  const Json j = Json::parse(json);
  std::string text;
  if (j.contains("psnr_mean_db")) {
    text += fmt::format("{:<28} {:>9} {:>7} {:>9} {:>13}\n", "held-out photo", "PSNR dB", "SSIM", "coverage", "nearest photo");
    for (const auto& v : j["views"])
      text += fmt::format("{:<28} {:>9.2f} {:>7.4f} {:>8.1f}% {:>10.2f} dB\n", v["name"].get<std::string>(), v["psnr_db"].get<double>(),
                          v["ssim"].get<double>(), 100 * v["coverage"].get<double>(), v["nearest_photo_psnr_db"].get<double>());
    text += fmt::format("{:<28} {:>9.2f} {:>7.4f} {:>8.1f}% {:>10.2f} dB\n", "mean", j["psnr_mean_db"].get<double>(), j["ssim_mean"].get<double>(),
                        100 * j["coverage"].get<double>(), j["nearest_photo_psnr_mean_db"].get<double>());
  } else if (j.contains("views")) {
    const auto& v = j["views"][0];
    text += fmt::format("{}: PSNR {:.2f} dB, SSIM {:.4f}, coverage {:.1f}%\n", v["name"].get<std::string>(), v["psnr_db"].get<double>(), v["ssim"].get<double>(),
                        100 * v["coverage"].get<double>());
  }
  if (j.contains("budget")) {
    const auto& b = j["budget"];
    text += fmt::format("{:g} ms a frame: {}, {:.1f} ms expected{}; {}\n", b["budget_ms"].get<double>(), b["name"].get<std::string>(), b["expected_ms"].get<double>(),
                        b["fits"].get<bool>() ? "" : " (the fastest there is)", b["why"].get<std::string>());
  }
  for (const auto& e : j["effects"])
    text += fmt::format("{:<11} {:<4} {}{}\n", e["name"].get<std::string>(), e["on"].get<bool>() ? "on" : "off", e["evidence"].get<std::string>(),
                        e["on"].get<bool>() ? fmt::format(" ({:.1f} ms)", e["cost_ms"].get<double>()) : "");
  text += fmt::format("{} frames, {:.1f} ms each, proxy {}, {}", j["frames"].get<long>(), j["ms_per_frame"].get<double>(),
                      j["proxy"].get<std::string>(), j["device"].get<std::string>());
  return text;
}

}  // namespace lumi
