#include "render/commands/render_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>

#include "render/effects/effects.h"
#include "render/effects/exposure.h"
#include "render/holdout/holdout.h"
#include "render/path/camera_path.h"
#include "render/path/matrix_path.h"
#include "render/picture/convert.h"
#include "render/picture/output_name.h"
#include "render/settings_json.h"
#include "render/show/camera_configuration.h"
#include "render/show/measure_map.h"
#include "render/show/proxy_picture.h"
#include "render/time/clock.h"
#include "render/tradeoff/budget.h"
#include "render/tradeoff/sweep.h"
#include "render/world/per_view_proxy.h"
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
  if (o.backend == "gl" && (!o.budget_ms || o.decided.count("grid") > 0)) RequireDrawnByGl(o.settings);
  if (o.budget_ms && !(*o.budget_ms > 0 && std::isfinite(*o.budget_ms))) throw UsageError("--budget-ms must be above 0");
  if (o.holdout != 0 && o.holdout < 2) throw UsageError("--holdout takes 2 or more");
  if (o.holdout != 0 && !o.view.empty()) throw UsageError("--holdout and --view do not go together");
  if (!o.path.empty() && (o.holdout != 0 || !o.view.empty())) throw UsageError("--path goes with neither --holdout nor --view");
  if (o.show == "cameras" && o.view.empty() && o.path.empty()) throw UsageError("--show cameras needs --view or --path: the virtual view that is drawn among them");
  if (!o.of.empty() && !MeasureFromName(o.show)) throw UsageError("--of goes with --show weights, angle, fov, resolution, visibility, time or dissimilarity");
  if (o.holdout != 0 && o.show != "color") throw UsageError("--holdout compares colours: --show does not go with it");
  if (o.show == "difference" && o.view.empty()) throw UsageError("--show difference needs --view: the photo to compare with");
  // What would be passed over in silence.
  const auto given = [&](const char* name) { return o.decided.count(name) > 0; };
  if (o.phase && !std::isfinite(*o.phase)) throw UsageError("--phase must be a number");
  if (o.settings.Sparse() && !o.budget_ms && !HasSamples(o.settings))
    throw UsageError("--grid with --k all needs --sampling interpolated: all photos are candidates at every pixel");
  if (o.show == "tessellation" && !o.budget_ms && !HasSamples(o.settings))
    throw UsageError("--show tessellation needs --grid: there are no sparse samples to show");
  if (o.holdout != 0 && o.height_px > 0) throw UsageError("--holdout keeps the photos' aspect: --width, not --height");
  if (o.holdout != 0 && given("format")) throw UsageError("--holdout writes JPEG: --format does not go with it");
  if (o.holdout == 0 && given("fold")) throw UsageError("--fold goes with --holdout");
  const bool path_is_given = !o.path.empty(), is_path = o.holdout == 0 && o.view.empty();
  if (o.video && !is_path) throw UsageError("--video shows a path, not --view or --holdout");
  for (const char* name : {"seconds", "fps"})
    if (given(name) && (path_is_given || !is_path))
      throw UsageError(std::string("--") + name + " is of the path through the photos: neither --path, --view nor --holdout goes with it");
  if (given("format") && o.output.extension() == ".mp4") throw UsageError("--format is of pictures: -o names a video");
  if (o.format == "exr" && !o.view.empty() && (o.show == "cameras" || o.show == "difference"))
    throw UsageError("--show " + o.show + " is drawn in 8 bits: --format png or jpg");
  if (given("fill-frames") && o.border != "fill") throw UsageError("--fill-frames goes with --border fill");
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
    if (scene_.views.empty()) throw DataError("the scene has no photos with cameras", "", o_.scene);
    if (!o_.view.empty()) view_ = ViewCalled(o_.view);
    ChooseMatrices();
    if (scene_.frame != Frame::kMetric) RequireNothingMetric();
    if (!matrices_.keys.empty() || !Metric()) reach_ = TakeWindow(scene_, o_.window_frames, !matrices_.keys.empty(), decided_, settings_);
    if (o_.proxy == kPerViewProxy || !Metric()) {
      PerViewOptions own;
      own.nominal_focal_px = o_.nominal_focal_px;
      per_view_.emplace(scene_, own);
    } else {
      mesh_ = LoadProxy(scene_, o_.proxy);
    }
    ApplyTime();
    if (!per_view_) photos_ = LoadPhotos(scene_, {}, sink_);
    double gain_spread = 1;
    if (decided_.count("exposure") == 0 || settings_.exposure) {
      const Exposures exposures = per_view_ ? EstimateExposures(scene_, sink_) : EstimateExposures(scene_, photos_);
      if (exposures.Differ()) gain_spread = exposures.spread;
      for (std::size_t i = 0; i < scene_.views.size(); ++i) scene_.views[i].gain = exposures.gain[i];
    }
    std::vector<bool> use;
    const std::vector<RenderView> desired = DesiredViews(use);
    const RendererMaker make = o_.backend == "gl" ? MakeGlRenderer : MakeCpuRenderer;
    if (per_view_) {
      UsePerView();
      const auto world = [&](const RenderView& view) {
        PictureWorld w = per_view_->For(view, reach_);
        for (std::size_t i = 0; i < w.photos.size(); ++i) w.use[i] = w.use[i] && (use.empty() || use[static_cast<std::size_t>(w.photos[i])]);
        return w;
      };
      choice_ = ChooseEffects(scene_, desired, world, settings_, decided_, gain_spread);
      if (!Metric() && choice_.settings.resolution == Resolution::kDistance) choice_.settings.resolution = Resolution::kJacobian;
      // What nobody asked for was not asked for by an option.
      const std::string asked = "asked for by an option";
      for (Effect& e : choice_.effects)
        if (o_.effects == "auto" && o_.decided.count(e.name) == 0 && decided_.count(e.name) > 0 && e.evidence.starts_with(asked))
          e.evidence.replace(0, asked.size(), reach_ >= 0 && e.name != "visibility" ? "so for pictures of a window in time" : "so for a proxy of each view");
      BorderOptions border;
      border.fill = o_.border == "fill";
      border.reach = o_.fill_frames;
      auto renderer = MakePerViewRenderer(scene_, *per_view_, make, reach_, border);
      own_pictures_ = renderer.get();
      renderer_ = std::move(renderer);
    } else {
      if (o_.border == "fill" || o_.nominal_focal_px > 0)
        throw UsageError("--border fill and --nominal-focal-px are of pictures that have a proxy of their own", "add --proxy per-view");
      choice_ = ChooseEffects(scene_, mesh_, desired, use, settings_, decided_, gain_spread);
      renderer_ = make(scene_, mesh_, photos_);
    }
    settings_ = choice_.settings;
  }

  std::string Run() {
    std::vector<bool> use;
    const RenderView first = DesiredViews(use).front();
    KeepBudget(first, use);
    choice_.settings = SettingsFor(first);
    if (o_.show == "tessellation" && !HasSamples(settings_))
      sink_.Message("the budget is kept without sparse samples: --show tessellation has none to show");
    MeasureEffects(*renderer_, first, use, choice_);
    Json j = o_.holdout != 0 ? Holdout() : !o_.view.empty() ? OneView() : Path();
    j["proxy"] = ProxyName();
    if (!Metric()) j["frame"] = Name(scene_.frame);
    if (reach_ >= 0) j["window_frames"] = reach_;
    j["device"] = renderer_->Device();
    j["settings"] = SettingsJson();
    if (budget_) j["budget"] = Budget();
    if (!scale_.is_null()) j["scale"] = scale_;
    j["effects"] = Json::array();
    for (const Effect& e : choice_.effects) j["effects"].push_back({{"name", e.name}, {"on", e.on}, {"evidence", e.evidence}, {"cost_ms", e.cost_ms}});
    if (samples_ > 0) j["samples"] = samples_;
    if (optimum_.samples > 0)
      j["optimum"] = {{"samples", optimum_.samples},
                      {"cameras_mean", static_cast<double>(optimum_.cameras) / static_cast<double>(optimum_.samples)},
                      {"dense", optimum_.dense},
                      {"nugget_raised", optimum_.nugget_raised},
                      {"indefinite", optimum_.indefinite},
                      {"small_sums", optimum_.small_sums}};
    if (2 * optimum_.small_sums > optimum_.samples)
      sink_.Message(fmt::format("at {:.0f} % of the samples no photo correlates with the ray: they stand farther apart than 2 x --r-max-deg, and the "
                                "optimum falls back to the local mean; a larger --r-max-deg gives it something to say",
                                100.0 * static_cast<double>(optimum_.small_sums) / static_cast<double>(optimum_.samples)));
    if (!o_.output.empty() && o_.output.extension() != ".mp4") WriteTextAtomically(o_.output / kMarker, j.dump(2) + "\n");
    return j.dump();
  }

 private:
  Json SettingsJson() const {
    Json j = ToJson(settings_);
    if (own_times_) j.erase("time-s");  // differs from frame to frame: as an option it would stop them all
    j["backend"] = o_.backend;
    return j;
  }

  Json Budget() const {
    Json j = {{"budget_ms", *o_.budget_ms}};
    j.update(ToJson(*budget_));
    return j;
  }

  // --budget-ms: the settings for frames like this one. What the user decided stays.
  void KeepBudget(const RenderView& first, const std::vector<bool>& use) {
    if (!o_.budget_ms) return;
    RenderRequest request;
    request.view = first;
    request.settings = SettingsFor(first);
    request.use = use;
    FixedOptions fixed;
    const Json now = ToJson(settings_);
    for (const std::string& name : decided_)
      if (now.contains(name)) fixed.emplace_back(name, now[name].is_string() ? now[name].get<std::string>() : now[name].dump());
    budget_ = ChooseForBudget(scene_.folder, o_.backend, ProxyName(), *renderer_, request, fixed, *o_.budget_ms);
    settings_ = budget_->settings;
    for (Effect& e : choice_.effects)
      if (const bool on = settings_.resolution != Resolution::kOff; e.name == "resolution" && e.on != on) {
        e.on = on;
        e.evidence = "chosen with the budget";
      }
  }

  // A proxy to draw beside the picture of a view. Metric scenes.
  Mesh ProxyFor(const RenderView& view) const { return per_view_ ? per_view_->For(view, reach_).proxy : mesh_; }

  // What a photo sees of a surface made for another view is not known.
  void UsePerView() {
    if (decided_.count("visibility") > 0 && settings_.visibility) throw UsageError("--proxy per-view hides nothing: --visibility does not go with it");
    settings_.visibility = false;
    decided_.insert("visibility");
  }

  bool Metric() const { return scene_.frame == Frame::kMetric; }
  std::string ProxyName() const { return per_view_ ? kPerViewProxy : o_.proxy.empty() ? scene_.active_proxy : o_.proxy; }

  // --path of matrices; without --path the photos' own where there are no poses.
  void ChooseMatrices() {
    if (o_.holdout != 0 || !o_.view.empty()) return;
    if (!o_.path.empty() && IsMatrixPath(o_.path))
      matrices_ = ReadMatrixPath(o_.path);
    else if (!Metric() && !o_.path.empty())
      throw DataError(fmt::format("{} is a path of poses, which a {} scene does not have", o_.path.generic_string(), Name(scene_.frame)),
                      "a path of projection matrices comes from lumi-stabilize", o_.scene);
    else if (!Metric()) {
      if (decided_.count("seconds") > 0) throw UsageError("--seconds is of a path between poses, which this scene does not have: a frame a photo");
      matrices_ = MatrixPathOfPhotos(scene_, o_.fps);
    }
  }

  // What needs distances, or angles that are true.
  void RequireNothingMetric() const {
    const std::string frame(Name(scene_.frame));
    if (!o_.proxy.empty() && o_.proxy != kPerViewProxy)
      throw UsageError(fmt::format("a {} scene is rendered with each view's own proxy: --proxy per-view", frame));
    if (o_.show == "cameras") throw UsageError(fmt::format("--show cameras draws distances, which a {} scene does not have", frame));
    if (decided_.count("resolution") > 0 && settings_.resolution == Resolution::kDistance && o_.settings.resolution == Resolution::kDistance)
      throw UsageError(fmt::format("--resolution distance compares distances, which a {} scene does not have", frame), "use --resolution jacobian");
  }

  // Of what a picture of this view is made of. use: the photos that it may use.
  std::vector<bool> InWindow(const RenderView& view, std::vector<bool> use) const {
    if (per_view_ || reach_ < 0) return use;
    const PhotoOrder order(scene_);
    const auto [first, last] = order.Around(view.time_s, reach_);
    std::vector<bool> within(scene_.views.size(), false);
    for (int rank = first; rank <= last; ++rank) {
      const auto v = static_cast<std::size_t>(order.view(rank));
      within[v] = use.empty() || use[v];
    }
    return within;
  }

  // A time was asked for, or each frame has its own.
  void ApplyTime() {
    TakeClock(scene_, decided_.count("time-window-s") > 0, settings_);
    own_times_ = !o_.phase && decided_.count("time-s") == 0;
    if (own_times_) settings_.time_s = FirstTime(scene_).value_or(settings_.time_s);
    if (!o_.phase) return;
    if (!(settings_.period_s > 0)) throw DataError("the scene has no period, so that --phase says nothing", "use --time-s", o_.scene);
    settings_.time_s = *o_.phase * settings_.period_s;
  }

  RadianceSettings SettingsFor(const RenderView& view) const { return own_times_ ? AtTimeOf(settings_, view) : settings_; }

  // What will be rendered, and from which photos.
  std::vector<RenderView> DesiredViews(std::vector<bool>& use) const {
    std::vector<RenderView> desired;
    if (o_.holdout != 0) {
      use.assign(scene_.views.size(), true);
      for (const ViewId id : FoldViews(scene_, o_.holdout, o_.fold == "choose" ? Fold::kChoose : Fold::kReport)) {
        use[static_cast<std::size_t>(id.value)] = false;
        desired.push_back(HeldOutView(scene_, scene_.views[static_cast<std::size_t>(id.value)], o_.width_px));
      }
      if (std::none_of(use.begin(), use.end(), [](bool u) { return u; })) use.clear();
    } else if (!o_.view.empty()) {
      desired.push_back(RequestedView());
      if (o_.leave_out) {
        use.assign(scene_.views.size(), true);
        use[static_cast<std::size_t>(view_)] = false;
      }
    } else {
      desired = Frames();
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
    if (o_.show == "proxy") {
      if (!per_view_) return DrawProxy(MakeSources(scene_), mesh_, request.view);
      const PictureWorld world = per_view_->For(request.view, reach_);
      return DrawProxy(world.sources, world.proxy, world.view);
    }
    const auto measure = MeasureFromName(o_.show);
    if (!measure) {
      ImageF image = renderer_->Render(request);
      const RenderStatistics statistics = renderer_->Statistics();
      samples_ += statistics.samples;
      optimum_ += statistics.optimum;
      return image;
    }
    const int of = o_.of.empty() ? -1 : ViewCalled(o_.of);
    MeasureMap map = per_view_ ? RenderMeasureMap(per_view_->For(request.view, reach_), request, *measure, of) : RenderMeasureMap(scene_, mesh_, request, *measure, of);
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
    h.own_times = own_times_;
    h.folder = o_.output;
    const HoldoutSummary s = EvaluateHoldout(scene_, *renderer_, h, sink_);
    samples_ = s.samples;
    optimum_ = s.optimum;
    Json views = Json::array();
    for (const HoldoutView& v : s.views) {
      views.push_back({{"name", v.name}, {"psnr_db", v.psnr_db}, {"ssim", v.ssim}, {"coverage", v.coverage},
                       {"nearest_photo", v.nearest_name}, {"nearest_photo_psnr_db", v.nearest_psnr_db},
                       {"nearest_photo_ssim", v.nearest_ssim}, {"nearest_photo_coverage", v.nearest_coverage}, {"ms", v.ms},
                       {"file", OutputName(v.name)}});
      if (v.psnr_object_db) views.back()["psnr_object_db"] = *v.psnr_object_db;
      if (v.nearest_psnr_object_db) views.back()["nearest_photo_psnr_object_db"] = *v.nearest_psnr_object_db;
    }
    Json j = {{"frames", s.views.size()},
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
    if (s.psnr_object_mean_db) j["psnr_object_mean_db"] = *s.psnr_object_mean_db;
    if (s.nearest_psnr_object_mean_db) j["nearest_photo_psnr_object_mean_db"] = *s.nearest_psnr_object_mean_db;
    return j;
  }

  // The camera of --view, at the size that is wanted.
  RenderView RequestedView() const {
    const View& view = scene_.views[static_cast<std::size_t>(view_)];
    Eigen::Vector2i size = SizePx(scene_, view);
    if (o_.width_px > 0 || o_.height_px > 0) {
      const double aspect = static_cast<double>(size.y()) / size.x();
      const int width = o_.width_px > 0 ? o_.width_px : static_cast<int>(std::lround(o_.height_px / aspect));
      const int height = o_.height_px > 0 ? o_.height_px : static_cast<int>(std::lround(width * aspect));
      size = {std::max(1, width), std::max(1, height)};
    }
    return PhotosView(scene_, view, size);
  }

  // Of the path, whichever it is.
  std::vector<RenderView> Frames() const {
    if (matrices_.keys.empty()) return PathViews(RequestedPath());
    const double aspect = static_cast<double>(matrices_.height_px) / matrices_.width_px;
    const int width = o_.width_px > 0 ? o_.width_px : o_.height_px > 0 ? std::max(1, static_cast<int>(std::lround(o_.height_px / aspect))) : matrices_.width_px;
    const int height = o_.height_px > 0 ? o_.height_px : o_.width_px > 0 ? std::max(1, static_cast<int>(std::lround(width * aspect))) : matrices_.height_px;
    return MatrixViews(scene_, matrices_, width, height);
  }

  CameraPath RequestedPath() const { return o_.path.empty() ? PathThroughPhotos(scene_, o_.seconds, o_.fps) : ReadCameraPath(o_.path); }

  std::vector<RenderView> PathViews(const CameraPath& path) const {
    const Camera& first = scene_.CameraOf(scene_.views.front());
    int width = o_.width_px > 0 ? o_.width_px : path.width_px > 0 ? path.width_px : 0;
    int height = o_.height_px > 0 ? o_.height_px : path.height_px > 0 && o_.width_px == 0 ? path.height_px : 0;
    const double aspect = static_cast<double>(first.height_px) / first.width_px;
    if (width == 0) width = height > 0 ? static_cast<int>(std::lround(height / aspect)) : std::min(kDefaultPathWidth, first.width_px);
    if (height == 0) height = static_cast<int>(std::lround(width * aspect));
    std::vector<RenderView> views = SamplePath(path, width, height);
    // The path's clock begins at the scene's first moment.
    const std::optional<double> first_time = FirstTime(scene_);
    for (RenderView& v : views) v.time_s = first_time ? std::optional(*first_time + (*v.time_s - path.keys.front().time_s)) : std::nullopt;
    return views;
  }

  Json OneView() {
    const View& view = scene_.views[static_cast<std::size_t>(view_)];
    RenderRequest request;
    request.view = RequestedView();
    request.settings = SettingsFor(request.view);
    request.show = ShowMode();
    if (o_.leave_out) {
      request.use.assign(scene_.views.size(), true);
      request.use[static_cast<std::size_t>(view_)] = false;
    }
    const auto start = Clock::now();
    const ImageF image = Picture(request);
    const double ms = Milliseconds(start);
    Json figures = {{"name", view.name}, {"coverage", Coverage(image)}};
    if (request.settings.time) figures["time_s"] = request.settings.time_s;
    Image8 photo, rendered;
    // Heat maps and false colours are no picture of what was photographed.
    if (o_.show == "color" || o_.show == "difference") {
      photo = Resize(ReadImage8(scene_.ImagePath(view), 3), image.width, image.height);
      rendered = ToRgb8(image);
      const ImageDifference d = Compare(rendered, photo);
      figures["psnr_db"] = d.psnr_db;
      figures["ssim"] = d.ssim;
      figures["mean_absolute_difference"] = d.mean_absolute;
      figures["mean_absolute_difference_seen"] = SeenDifference(image, photo);
    }
    const std::filesystem::path stem = o_.output / OutputName(view.name);
    if (o_.show == "cameras")
      WriteImage(stem.string() + (o_.format == "jpg" ? ".jpg" : ".png"), DrawCameraConfiguration(scene_, ProxyFor(request.view), request.view, kConfigurationSide));
    else if (o_.show == "difference")
      WriteImage(stem.string() + (o_.format == "jpg" ? ".jpg" : ".png"), DifferenceImage(rendered, photo));
    else
      Write(stem, image);
    Json views = Json::array();
    views.push_back(figures);
    return {{"frames", 1}, {"ms_per_frame", ms}, {"coverage", Coverage(image)}, {"views", views}};
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

  // Over black, as ToRgb8 gives the frame when it is rendered (a JPEG: nearly). PNG holds colours that are not multiplied by alpha.
  static Image8 FrameOnDisk(const std::filesystem::path& file) {
    if (file.extension() == ".exr") return ToRgb8(ReadImageF(file));
    const Image8 rgba = ReadImage8(file, 4);
    Image8 rgb(rgba.width, rgba.height, 3);
    for (int y = 0; y < rgb.height; ++y)
      for (int x = 0; x < rgb.width; ++x)
        for (int c = 0; c < 3; ++c) rgb.At(x, y, c) = static_cast<std::uint8_t>((rgba.At(x, y, c) * rgba.At(x, y, 3) + 127) / 255);
    return rgb;
  }

  Json Path() {
    const std::vector<RenderView> views = Frames();
    const double fps = matrices_.keys.empty() ? RequestedPath().fps : matrices_.fps;
    const int width = views.front().size_px.x(), height = views.front().size_px.y();

    const bool only_video = o_.output.extension() == ".mp4";
    const std::filesystem::path frames_folder = only_video ? std::filesystem::path() : o_.output / "frames";
    // Frames that an earlier run with the same scene, path and settings finished are kept.
    const std::string wanted = FrameFingerprint(views, fps);
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
    if (only_video) video.emplace(o_.output, fps);
    if (!only_video && o_.video) video.emplace(o_.output / "path.mp4", fps);

    Progress progress(sink_, "rendering frames", static_cast<long>(views.size()));
    std::vector<double> times;
    double filled = 0;
    PictureCoverage seen;
    long rendered = 0, reused = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const std::filesystem::path stem = frames_folder / fmt::format("frame_{:06}", i);
      const std::filesystem::path file = stem.string() + "." + o_.format;
      if (!only_video && std::filesystem::exists(file)) {
        ++reused;
        if (video) video->Add(FrameOnDisk(file));
        progress.Step();
        continue;
      }
      RenderRequest request;
      request.view = views[i];
      request.settings = SettingsFor(request.view);
      request.show = ShowMode();
      request.use = InWindow(request.view, {});
      const auto start = Clock::now();
      const ImageF image = o_.show == "cameras" ? Opaque(DrawCameraConfiguration(scene_, ProxyFor(request.view), request.view, kConfigurationSide)) : Picture(request);
      times.push_back(Milliseconds(start));
      filled += Coverage(image);
      if (own_pictures_) {
        seen.window += own_pictures_->Coverage().window;
        seen.wider += own_pictures_->Coverage().wider;
      }
      ++rendered;
      if (!only_video) Write(stem, image);
      if (video) video->Add(ToRgb8(image));
      progress.Step();
    }
    if (video) video->Finish();
    Json j = {{"frames", views.size()}, {"frames_reused", reused},
              {"ms_per_frame", rendered > 0 ? Json(Median(times)) : Json(nullptr)}, {"width", width}, {"height", height}};
    const auto mean = [&](double sum) { return rendered > 0 ? Json(sum / static_cast<double>(rendered)) : Json(nullptr); };
    j["coverage"] = mean(filled);
    if (o_.border == "fill" && own_pictures_) {
      j["coverage_window"] = mean(seen.window);
      j["coverage_wider"] = mean(seen.wider);
    }
    if (video) j["video"] = (only_video ? o_.output : o_.output / "path.mp4").generic_string();
    return j;
  }

  std::string FrameFingerprint(const std::vector<RenderView>& views, double fps) const {
    Json j = {{"settings", ToJson(settings_)}, {"own_times", own_times_}, {"backend", o_.backend},
              {"show", o_.show}, {"of", o_.of}, {"width", views.front().size_px.x()}, {"height", views.front().size_px.y()},
              {"scene", Fingerprint(scene_.folder / (Metric() ? "sparse" : "projective.json"))}, {"manifest", Fingerprint(scene_.folder / "lumigraph.json")}};
    if (per_view_ || !Metric())
      j["own"] = {{"window_frames", reach_}, {"border", o_.border}, {"fill_frames", o_.fill_frames}, {"nominal_focal_px", o_.nominal_focal_px}};
    j["proxy"] = per_view_ ? std::string(kPerViewProxy) : Fingerprint(ProxyPath(scene_.folder, o_.proxy.empty() ? scene_.active_proxy : o_.proxy));
    // The photos alone: an image folder may hold these frames, too.
    for (const View& v : scene_.views) j["photos"].push_back({v.name, Fingerprint(scene_.ImagePath(v))});
    j["fps"] = fps;
    for (const RenderView& v : views) {
      Json frame = {v.time_s ? Json(*v.time_s) : Json(nullptr), v.gain};
      for (int i = 0; i < 12; ++i) frame.push_back(v.P(i / 4, i % 4));
      j["frames"].push_back(std::move(frame));
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
  long samples_ = 0;                    // of all frames rendered: rays at which weights were computed ...
  OptimumCounts optimum_;               // ... and what the optimum says of them
  Scene scene_;
  Mesh mesh_;                           // empty where each picture has its own
  std::optional<PerViewProxy> per_view_;
  PerViewRenderer* own_pictures_ = nullptr;  // renderer_, where each picture has a proxy of its own
  MatrixPath matrices_;                 // without keys: the path is one of poses
  int reach_ = -1;                      // photos to either side in time that a picture may use; -1: all
  int view_ = -1;
  bool own_times_ = true;               // each frame is rendered at its view's time; else all at settings_.time_s
  std::vector<Photo> photos_;
  std::unique_ptr<Renderer> renderer_;
};

}  // namespace

const std::vector<std::string>& ShowNames() {
  static const std::vector<std::string> names = {"color", "false-color", "tessellation", "weights", "angle", "fov", "resolution",
                                                 "visibility", "time", "dissimilarity", "difference", "cameras", "proxy"};
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
    if (j.contains("psnr_object_mean_db"))
      text += fmt::format("{:<28} {:>9.2f} {:>7} {:>9} {:>10.2f} dB\n", "mean over the object", j["psnr_object_mean_db"].get<double>(), "", "",
                          j.value("nearest_photo_psnr_object_mean_db", 0.0));
  } else if (j.contains("views")) {
    const auto& v = j["views"][0];
    text += v["name"].get<std::string>() + ": ";
    if (v.contains("psnr_db")) text += fmt::format("PSNR {:.2f} dB, SSIM {:.4f}, ", v["psnr_db"].get<double>(), v["ssim"].get<double>());
    text += fmt::format("coverage {:.1f}%\n", 100 * v["coverage"].get<double>());
  }
  if (j.contains("budget")) {
    const auto& b = j["budget"];
    text += fmt::format("{:g} ms a frame: {}, {:.1f} ms expected{}; {}\n", b["budget_ms"].get<double>(), b["name"].get<std::string>(), b["expected_ms"].get<double>(),
                        b["fits"].get<bool>() ? "" : " (the fastest there is)", b["why"].get<std::string>());
  }
  for (const auto& e : j["effects"])
    text += fmt::format("{:<11} {:<4} {}{}\n", e["name"].get<std::string>(), e["on"].get<bool>() ? "on" : "off", e["evidence"].get<std::string>(),
                        e["on"].get<bool>() ? fmt::format(" ({:.1f} ms)", e["cost_ms"].get<double>()) : "");
  const std::string each = !j["ms_per_frame"].is_number() ? "all there already" : fmt::format("{:.1f} ms each", j["ms_per_frame"].get<double>());
  text += fmt::format("{} frames, {}, proxy {}, {}", j["frames"].get<long>(), each, j["proxy"].get<std::string>(),
                      j["device"].get<std::string>());
  return text;
}

}  // namespace lumi
