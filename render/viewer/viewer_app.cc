// The viewer's frame: what is drawn, composed, and how long to wait for the next.
#include "render/viewer/viewer_app.h"

#include <epoxy/gl.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "render/settings_json.h"
#include "render/viewer/canvas.h"
#include "scene/files/image_io.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"

namespace lumi {
namespace {

constexpr double kIdleWait_s = 0.2;          // between looks at the world when nothing happens
constexpr double kLoadingWait_s = 0.02;      // the cores are for the photos then
constexpr double kRefiningWait_s = 0.1;      // and here for the refined picture
constexpr double kSmoothing = 0.1;           // of times that are shown

}  // namespace

Viewer::Viewer(const ViewerOptions& options, Window& window, Opened& opened, ProgressSink& progress, std::vector<ScriptStep> script)
    : options_(options),
      window_(window),
      lumigraph_(opened.lumigraph),
      scene_(lumigraph_.scene()),
      progress_(progress),
      budget_(PlanPhotos(scene_, static_cast<std::size_t>(options.memory_mb) * static_cast<std::size_t>(kMb))),
      gl_(MakeSources(scene_), budget_.sizes_px),
      painter_(gl_, PainterOptions{}),
      home_(StateOfView(scene_, StartView())),
      navigator_(home_, scene_.up, 1.0 / scene_.normalized_from_world.scale),
      loader_(scene_, budget_.max_side_px, std::clamp(ThreadCount() - 1, 1, 6)),
      effects_(opened.effects),
      decided_(options.decided),
      small_photos_(scene_.views.size()),
      motion_probe_(gl_),
      photos_(std::make_shared<std::vector<Photo>>(scene_.views.size())),
      path_(opened.path),
      probe_(scene_, gl_),
      script_(script.begin(), script.end()),
      scripted_(!script.empty()) {
  RadianceSettings& s = settings_.radiance;
  s = lumigraph_.settings();
  std::vector<double> times;
  for (const View& v : scene_.views)
    if (v.time_s) times.push_back(*v.time_s);
  if (!times.empty()) facts_.times = {*std::min_element(times.begin(), times.end()), *std::max_element(times.begin(), times.end())};
  facts_.period_s = s.period_s;
  if (options.effects == "auto") ApplyEffects(effects_, decided_, s);
  // Who names a moment wants to see it.
  if (!times.empty() && options.effects == "auto" && (options.phase || decided_.count("time-s") > 0)) s.time = true;
  settings_.panel = options.show_ui;
  settings_.budget_ms = options.budget_ms;
  settings_.refine = options.refine;
  loader_.SetFocus(home_.cam_from_world);
  SetProxy(std::move(opened.proxy));
  for (const View& v : scene_.views) facts_.photo_names.push_back(v.name);
  facts_.scene = std::filesystem::absolute(options.scene).lexically_normal().filename().string();
  if (facts_.scene.empty()) facts_.scene = "lumigraph";
  facts_.device = GlDeviceName();
  facts_.photos_total = static_cast<int>(scene_.views.size());
  facts_.budget_mb = options.memory_mb;
  for (int side = budget_.max_side_px; 2 * side <= LargestSide(); side *= 2) ++facts_.halvings;
  facts_.proxies = ListProxies(scene_.folder);
  facts_.effects = effects_.effects;
  PathEdited();
}

RenderRequest Viewer::Request(const Eigen::Vector2i& size_px, const RadianceSettings& settings) const {
  RenderRequest r;
  r.view = MakeWindowView(navigator_.state(), size_px.x(), size_px.y());
  r.settings = settings;
  r.show = settings_.seen.show == Show::kTessellation && !settings.Sparse() ? Show::kColor : settings_.seen.show;
  return r;
}

// Settings that are invalid are not tried; settings that the backend does not do keep what was drawn before.
bool Viewer::Paint() {
  const RadianceSettings asked = Drawn();
  const std::string problem = Validate(asked);
  const bool usable = problem.empty() && !(refused_ && *refused_ == asked);
  if (usable) refused_.reset();
  facts_.problem = !problem.empty() ? problem : refused_ ? refusal_ : "";
  const bool may_refine = !Loading() && !path_recording_ && !probe_.drawing();
  for (RadianceSettings wanted = usable ? asked : accepted_;;) {
    const RenderRequest request = Request(size_px_, wanted);
    const bool moved = !drawn_ || drawn_->view.P != request.view.P;
    const bool changed = !drawn_ || !Same(*drawn_, request) || drawn_generation_ != generation_;
    const RadianceSettings quick =
        motion_.active() ? motion_.Next(std::chrono::duration<double>(Clock::now().time_since_epoch()).count(), moved, wanted) : wanted;
    try {
      painter_.Paint(request, Request(painter_.PreviewSize(size_px_), quick), changed, may_refine);
    } catch (const UsageError& e) {
      if (!(quick == wanted)) {
        motion_.End();
        settings_.budget_ms = 0;
        Say(e.what());
        continue;
      }
      // Not even what was drawn before: the defaults are what every backend does.
      if (wanted == RadianceSettings{}) throw;
      refusal_ = e.what();
      if (!e.hint().empty()) refusal_ += ": " + e.hint();
      facts_.problem = refusal_;
      if (wanted == accepted_ || painter_.empty()) accepted_ = {};
      if (wanted == asked) refused_ = wanted;
      wanted = accepted_;
      continue;
    }
    if (painter_.preview_ms() > 0) motion_.Measured(painter_.preview_ms());
    accepted_ = wanted;
    drawn_ = request;
    drawn_generation_ = generation_;
    return changed;
  }
}

// Begins to hold a frame time, or ends it, as the settings say.
void Viewer::KeepBudget() {
  if (settings_.budget_ms > 0) {
    if (settings_.budget_ms != motion_.budget_ms())
      motion_.Begin(settings_.budget_ms, scene_.folder, {facts_.proxy, "gl", facts_.device, size_px_.x(), size_px_.y()},
                    settings_.radiance);
  } else if (motion_.active()) {
    motion_.End();
    motion_probe_.Cancel();
  }
  painter_.SetMovingTime(motion_.active() ? motion_.budget_ms() : PainterOptions{}.moving_ms);
  facts_.budget_now = motion_.ToProbe() != nullptr ? "measuring what settings cost ..." : motion_.name();
}

// One setting after another at the moving picture's size, twice each: the first pays for its shaders.
void Viewer::StepBudgetProbe() {
  const RadianceSettings* wanted = motion_.ToProbe();
  if (wanted == nullptr || !Settled()) return;
  const Eigen::Vector2i size = painter_.PreviewSize(size_px_);
  try {
    motion_probe_.Start(Request(size, *wanted));
    painter_.Disturbed();
    motion_probe_.Step(0, false);
  } catch (const UsageError&) {
    motion_probe_warm_ = false;
    return motion_.Probed(std::nullopt);
  }
  if (motion_probe_warm_)
    motion_.Probed(motion_probe_.picture_ms() * static_cast<double>(size_px_.prod()) / static_cast<double>(size.prod()));
  motion_probe_warm_ = !motion_probe_warm_;
}

// The picture and what is over it, without the panel, into the bound framebuffer.
void Viewer::Compose() {
  if (painter_.empty()) return overlay_.PresentNothing(size_px_);
  const RenderView view = Normalized(MakeWindowView(navigator_.state(), size_px_.x(), size_px_.y()), scene_.normalized_from_world);
  if (settings_.seen.flat) {
    flat_.Draw(view, gl_);
    overlay_.Present(flat_, size_px_);
  } else if (settings_.seen.measure && !heat_.empty()) {
    overlay_.Present(heat_, size_px_);
  } else if (refined_.empty()) {
    overlay_.Present(painter_.shown(), painter_.shown_size_px(), size_px_);
  } else {
    overlay_.Present(refined_, size_px_);
  }
  const bool with_path = settings_.path && !path_.keys.empty() && !playing_s_;
  if (!settings_.frusta && !settings_.mesh && !with_path) return;
  const Overlay::Eye eye{view, &painter_.shown(), painter_.shown_size_px(), size_px_};
  if (settings_.mesh) overlay_.ProxyEdges(eye, gl_);
  if (with_path) DrawPath(eye);
  if (settings_.frusta) {
    std::vector<Eigen::Vector4f> colors;
    for (std::size_t j = 0; j < scene_.views.size(); ++j) {
      const Eigen::Vector3f c = SourceColor(static_cast<int>(j));
      const bool nearest = static_cast<int>(j) == facts_.nearest_photo;
      colors.emplace_back(nearest ? Eigen::Vector4f(1, 1, 1, 1)
                                  : Eigen::Vector4f(c.x(), c.y(), c.z(), gl_.Has({static_cast<int>(j)}) ? 0.9F : 0.3F));
    }
    constexpr double kFrustumDepth = 0.08;  // normalised: the scene's size is about 1
    overlay_.Frusta(eye, gl_.sources(), colors, kFrustumDepth);
  }
}

void Viewer::Screenshot(const std::filesystem::path& file, bool with_ui) {
  if (painter_.empty()) return;
  const Canvas canvas(size_px_);
  Compose();
  if (with_ui) window_.DrawUi();
  WriteImage(file, canvas.Read());
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  screenshots_.push_back(file.string());
  if (!scripted_) Say("wrote " + file.string());  // not into the next picture
}

std::filesystem::path Viewer::FreeScreenshotName() const {
  for (int i = 1;; ++i) {
    const std::filesystem::path name = fmt::format("{}-{:03d}.png", facts_.scene, i);
    if (!std::filesystem::exists(name)) return name;
  }
}

nlohmann::json Viewer::Run() {
  auto last = Clock::now();
  long frames = 0;
  double wait_s = 0;
  while (!window_.ShouldClose()) {
    CheckInterrupted();
    window_.Poll(wait_s);
    size_px_ = window_.FramebufferSize().cwiseMax(1);
    const double dt = std::min(SecondsSince(last), 0.25);
    last = Clock::now();

    TakePhotos();
    TakeProxy();
    TakeExposures();
    bool moving = Steer(window_.Take(), dt);
    moving |= navigator_.Tick(dt);
    moving |= Play(dt);
    if (scripted_) RunScript();
    loader_.SetFocus(navigator_.state().cam_from_world);
    KeepBudget();
    const bool changed = Paint();
    StepJobs();
    StepRefinement(changed, moving || navigator_.flying() || window_.Dragging());
    StepHeatMap();

    if (Clock::now() > message_until_) facts_.message.clear();
    facts_.nearest_photo = NearestView(scene_, navigator_.state());
    if (painter_.complete() && painter_.painted()) {
      facts_.plan_ms = gl_.statistics().plan_ms;
      // Smoothed over pictures of the same settings.
      const bool others = !(cost_settings_ == accepted_);
      cost_settings_ = accepted_;
      facts_.picture_ms = facts_.picture_ms == 0 || others ? painter_.picture_ms()
                                                           : facts_.picture_ms + kSmoothing * (painter_.picture_ms() - facts_.picture_ms);
    }
    facts_.complete = painter_.complete();
    facts_.scale = painter_.empty() ? 1.0 : static_cast<double>(painter_.shown_size_px().x()) / size_px_.x();
    window_.BeginUi();
    if (options_.show_ui) {
      const bool exposure = settings_.radiance.exposure;
      const PanelWishes wishes = DrawPanel(facts_, settings_);
      if (settings_.radiance.exposure != exposure) decided_.insert("exposure");  // before the photos' own word came
      Grant(wishes);
      if (window_.Dragging() && drag_pivot_)
        if (const auto x = Project(MakeWindowView(navigator_.state(), size_px_.x(), size_px_.y()).P, *drag_pivot_))
          DrawPivot(x->x(), x->y(), 1.0);
    }
    window_.EndUi();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    Compose();
    StepLiveRecording();
    window_.DrawUi();
    window_.Swap();
    ++frames;

    const double ms = 1000 * SecondsSince(last);
    if (painter_.painted()) frame_ms_.push_back(ms);
    facts_.frame_ms = facts_.frame_ms == 0 ? ms : facts_.frame_ms + kSmoothing * (ms - facts_.frame_ms);
    if (scripted_) {
      AfterPainting();
      if (script_.empty()) break;
    }
    const bool refining = !painter_.complete() && !Loading();
    if (moving || changed || refining || Working() || navigator_.flying() || window_.Dragging())
      wait_s = 0;
    else if (refiner_.busy())
      wait_s = kRefiningWait_s;
    else
      wait_s = !Settled() || RefinementOpen() || scripted_ || proxy_loading_.valid() ? kLoadingWait_s : kIdleWait_s;
  }

  // What was seen until the window closed is kept.
  if (live_recording_) {
    live_recording_->recorder->Finish();
    while (!live_recording_->recorder->Ended()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    CloseRecording(*live_recording_->recorder);
  }

  return Summary(frames);
}

nlohmann::json Viewer::Summary(long frames) {
  nlohmann::json j;
  j["frames"] = frames;
  std::sort(frame_ms_.begin(), frame_ms_.end());
  j["median_frame_ms"] = frame_ms_.empty() ? 0.0 : frame_ms_[frame_ms_.size() / 2];
  j["photos_loaded"] = facts_.photos_loaded;
  j["photos_total"] = facts_.photos_total;
  j["photos_failed"] = facts_.photos_failed;
  j["photo_mb"] = facts_.photo_mb;
  j["max_side_px"] = budget_.max_side_px;
  j["proxy"] = facts_.proxy;
  j["device"] = facts_.device;
  j["screenshots"] = screenshots_;
  j["settings"] = ToJson(settings_.radiance);
  j["refused"] = facts_.problem;
  j["moving"] = motion_.name();
  j["refined"] = RefinementSummary();
  j["keys"] = path_.keys.size();
  j["effects"] = nlohmann::json::array();
  for (const Effect& e : effects_.effects) j["effects"].push_back({{"name", e.name}, {"on", e.on}, {"evidence", e.evidence}});
  j["errors"] = nlohmann::json::array();
  for (const MeasuredError& e : errors_)
    j["errors"].push_back({{"photo", e.photo}, {"psnr_db", e.psnr_db}, {"ssim", e.ssim}, {"coverage", e.coverage}, {"ms", e.ms},
                           {"width", e.size_px.x()}, {"height", e.size_px.y()}, {"settings", ToJson(e.settings)}});
  j["videos"] = nlohmann::json::array();
  for (const auto& [file, count] : videos_) j["videos"].push_back({{"file", file}, {"frames", count}});
  return j;
}

}  // namespace lumi
