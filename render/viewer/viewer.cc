#include "render/viewer/viewer.h"

#include <epoxy/gl.h>

#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>
#include <thread>

#include "render/path/path_editing.h"
#include "render/settings_json.h"
#include "render/viewer/canvas.h"
#include "render/viewer/viewer_app.h"
#include "scene/files/image_io.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"

namespace lumi {
namespace {

constexpr double kIdleWait_s = 0.2;          // between looks at the world when nothing happens
constexpr double kLoadingWait_s = 0.02;      // the cores are for the photos then
constexpr double kLoadedRefresh_s = 0.35;    // photos that arrive are shown in batches
constexpr double kUploadTime_s = 0.025;      // a frame
constexpr double kFlight_s = 0.9;
constexpr double kOrbitPerPx = 0.006, kLookPerPx = 0.0025;  // radians
constexpr double kFlySpeed = 0.6;            // scene sizes a second
constexpr int kMostVideoSide = 8192;
constexpr int kExposureSide = 256;           // of the photos whose exposures are compared
constexpr double kSmoothing = 0.1;           // of times that are shown

}  // namespace

Viewer::Viewer(const ViewerOptions& options, Window& window, Opened& opened, ProgressSink& progress, std::vector<ScriptStep> script)
    : options_(options),
      window_(window),
      scene_(opened.scene),
      progress_(progress),
      budget_(PlanPhotos(scene_, static_cast<std::size_t>(options.memory_mb) * static_cast<std::size_t>(kMb))),
      lumigraph_(scene_, budget_.sizes_px),
      painter_(lumigraph_, PainterOptions{}),
      home_(StateOfView(scene_, StartView())),
      navigator_(home_, scene_.up, 1.0 / scene_.normalized_from_world.scale),
      loader_(scene_, budget_.max_side_px, std::clamp(ThreadCount() - 1, 1, 6)),
      effects_(opened.effects),
      decided_(options.decided),
      small_photos_(scene_.views.size()),
      motion_probe_(lumigraph_),
      path_(opened.path),
      probe_(scene_, lumigraph_),
      script_(script.begin(), script.end()),
      scripted_(!script.empty()) {
  RadianceSettings& s = settings_.radiance;
  s = options.settings;
  s.period_s = scene_.period_s.value_or(0);
  std::vector<double> times;
  for (const View& v : scene_.views)
    if (v.time_s) times.push_back(*v.time_s);
  if (!times.empty()) facts_.times = {*std::min_element(times.begin(), times.end()), *std::max_element(times.begin(), times.end())};
  facts_.period_s = s.period_s;
  if (!times.empty() && decided_.count("time-s") == 0) s.time_s = facts_.times.first;
  ApplyEffectList(options.effects, effects_, decided_, s);
  settings_.panel = options.show_ui;
  settings_.budget_ms = options.budget_ms;
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
  r.show = settings_.show == Show::kTessellation && !settings.Sparse() ? Show::kColor : settings_.show;
  return r;
}

static bool Same(const RenderRequest& a, const RenderRequest& b) {
  return a.view.P == b.view.P && a.view.size_px == b.view.size_px && a.show == b.show && a.settings == b.settings;
}

// Settings that are invalid are not tried; settings that the backend does not do keep what was drawn before.
bool Viewer::Paint() {
  const std::string problem = Validate(settings_.radiance);
  const bool usable = problem.empty() && !(refused_ && *refused_ == settings_.radiance);
  if (usable) refused_.reset();
  facts_.problem = !problem.empty() ? problem : refused_ ? refusal_ : "";
  const bool may_refine = !Loading() && !path_recording_ && !probe_.drawing();
  for (RadianceSettings wanted = usable ? settings_.radiance : accepted_;;) {
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
      if (wanted == settings_.radiance) refused_ = wanted;
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

void Viewer::SetProxy(PreparedProxy proxy) {
  lumigraph_.SetProxy(proxy.mesh, std::move(proxy.visibility));
  facts_.proxy = proxy.name;
  facts_.faces = static_cast<int>(proxy.mesh.faces.size());
  ++generation_;
}

// A small copy, for the photos' exposures.
void Viewer::KeepForExposure(ViewId view, const Photo& photo) {
  if (!exposures_wanted_) return;
  std::size_t level = 0;
  while (level + 1 < photo.levels.size() && std::max(photo.levels[level].width, photo.levels[level].height) > kExposureSide) ++level;
  Photo& kept = small_photos_[static_cast<std::size_t>(view.value)];
  kept.levels.assign(photo.levels.begin() + static_cast<std::ptrdiff_t>(level), photo.levels.end());
  kept.level0_shift = photo.level0_shift + static_cast<int>(level);
}

// When all photos are there, their exposures are compared: on another thread, then drawn with.
void Viewer::TakeExposures() {
  if (exposures_wanted_ && !exposing_.valid() && loader_.outstanding() == 0) {
    exposures_wanted_ = false;
    exposing_ = std::async(std::launch::async, [this, photos = std::move(small_photos_)] { return EstimateExposures(scene_, photos); });
  }
  facts_.effects_open = exposing_.valid() || exposures_wanted_;
  if (!exposing_.valid() || exposing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  const Exposures found = exposing_.get();
  facts_.effects_open = false;
  for (std::size_t i = 0; i < scene_.views.size(); ++i) scene_.views[i].gain = found.gain[i];
  lumigraph_.SetGains(found.gain);
  for (Effect& e : effects_.effects)
    if (e.name == "exposure") {
      e.on = found.Differ();
      e.evidence = e.on ? fmt::format("photos of one point differ by a factor of up to {:.2f}", found.spread) : "photos of one point agree";
    }
  facts_.effects = effects_.effects;
  if (options_.effects == "auto" && decided_.count("exposure") == 0) SwitchEffect(settings_.radiance, "exposure", found.Differ());
  if (settings_.radiance.exposure) ++generation_;
}

void Viewer::TakePhotos() {
  const auto start = Clock::now();
  while (SecondsSince(start) < kUploadTime_s) {
    std::optional<PhotoLoader::Loaded> loaded = loader_.Take();
    if (!loaded) break;
    const Image8* first = loaded->photo.levels.empty() ? nullptr : &loaded->photo.levels.front();
    const Eigen::Vector2i planned = budget_.sizes_px[static_cast<std::size_t>(loaded->view.value)];
    if (first != nullptr && (first->width != planned.x() || first->height != planned.y()))
      loaded->error = scene_.views[static_cast<std::size_t>(loaded->view.value)].name + " is not of its camera's size";
    if (!loaded->error.empty()) {
      ++facts_.photos_failed;
      progress_.Message(loaded->error);
      Say(loaded->error);
      continue;
    }
    lumigraph_.Upload(loaded->view, loaded->photo);
    KeepForExposure(loaded->view, loaded->photo);
    new_photos_ = true;
  }
  if (facts_.photos_failed == facts_.photos_total)
    throw InputError(scene_.image_folder, "none of the photos could be read: " + facts_.message);
  facts_.photos_loaded = lumigraph_.photo_count();
  facts_.photo_mb = static_cast<double>(lumigraph_.photo_bytes()) / kMb;
  if (new_photos_ && (loader_.outstanding() == 0 || SecondsSince(last_refresh_) > kLoadedRefresh_s)) {
    ++generation_;
    new_photos_ = false;
    last_refresh_ = Clock::now();
  }
}

void Viewer::WishProxy(const std::string& name) {
  if (name == facts_.proxy || proxy_loading_.valid()) return;
  proxy_loading_ =
      std::async(std::launch::async, [this, name, sources = lumigraph_.sources()] { return PrepareProxy(scene_, sources, name); });
}

void Viewer::TakeProxy() {
  facts_.proxy_loading = proxy_loading_.valid();
  if (!facts_.proxy_loading || proxy_loading_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  try {
    SetProxy(proxy_loading_.get());
  } catch (const Error& e) {
    Complain(e);
  }
}

// The proxy's point at a pixel of the window.
std::optional<Eigen::Vector3d> Viewer::PointAt(double x_px, double y_px) const {
  if (painter_.empty()) return std::nullopt;
  const Eigen::Vector2d scale = painter_.shown_size_px().cast<double>().cwiseQuotient(size_px_.cast<double>());
  const int x = std::clamp(static_cast<int>(x_px * scale.x()), 0, painter_.shown_size_px().x() - 1);
  const int y = std::clamp(static_cast<int>(y_px * scale.y()), 0, painter_.shown_size_px().y() - 1);
  const double depth = static_cast<double>(lumigraph_.ReadDepth(painter_.shown(), x, y));
  if (!(depth > 0)) return std::nullopt;
  const RenderView view = MakeWindowView(navigator_.state(), size_px_.x(), size_px_.y());
  const Eigen::Matrix3d M = view.P.leftCols<3>();
  const auto ray = RayDirection(view.P, {x_px, y_px});
  if (!ray) return std::nullopt;
  // The depth is along the optical axis, in normalised units.
  const Eigen::Vector3d to_depth_one = *ray * (M.row(2).norm() / M.row(2).dot(*ray));
  return view.centre + to_depth_one * (depth / scene_.normalized_from_world.scale);
}

// What an orbit turns about: the picked point, else what stands in the middle of the picture, else the scene's centre.
Eigen::Vector3d Viewer::Pivot() {
  if (pivot_) return *pivot_;
  if (const auto middle = PointAt(0.5 * size_px_.x(), 0.5 * size_px_.y())) return *middle;
  return scene_.normalized_from_world.Inverse() * Eigen::Vector3d::Zero();
}

void Viewer::Jump(int view, bool at_once) {
  const int n = static_cast<int>(scene_.views.size());
  current_photo_ = (view % n + n) % n;
  navigator_.FlyTo(StateOfView(scene_, ViewId{current_photo_}), at_once ? 0 : kFlight_s);
}

void Viewer::Key(int key) {
  RadianceSettings& r = settings_.radiance;
  const int current = current_photo_ >= 0 ? current_photo_ : NearestView(scene_, navigator_.state());
  switch (key) {
    case GLFW_KEY_ESCAPE: return window_.Close();
    case GLFW_KEY_F: settings_.show = settings_.show == Show::kColor ? Show::kFalseColor : Show::kColor; return;
    case GLFW_KEY_C: settings_.frusta = !settings_.frusta; return;
    case GLFW_KEY_P: settings_.mesh = !settings_.mesh; return;
    case GLFW_KEY_K: return AddKey({});
    case GLFW_KEY_SPACE:
      if (playing_s_)
        playing_s_.reset();
      else
        StartPlaying();
      return;
    case GLFW_KEY_H: settings_.help = !settings_.help; return;
    case GLFW_KEY_TAB: settings_.panel = !settings_.panel; return;
    case GLFW_KEY_LEFT_BRACKET: r.k = r.k == 0 ? kMaxBlend : std::max(1, r.k - 1); return Say(fmt::format("{} photos a pixel", r.k));
    case GLFW_KEY_RIGHT_BRACKET:
      r.k = r.k == 0 || r.k == kMaxBlend ? 0 : r.k + 1;
      return Say(r.k == 0 ? "all photos at every pixel" : fmt::format("{} photos a pixel", r.k));
    case GLFW_KEY_LEFT: return Jump(current - 1, false);
    case GLFW_KEY_RIGHT: return Jump(current + 1, false);
    case GLFW_KEY_HOME:
      pivot_.reset();
      current_photo_ = -1;
      return navigator_.FlyTo(home_, kFlight_s);
    case GLFW_KEY_F12: return Screenshot(FreeScreenshotName(), false);
    default: return;
  }
}

// Returns whether the user moves the camera.
bool Viewer::Steer(const WindowInput& input, double dt_s) {
  for (const int key : input.keys) Key(key);
  if (input.double_click_px) {
    if (const auto point = PointAt(input.double_click_px->x(), input.double_click_px->y())) {
      pivot_ = point;
      Say("orbits turn about this point");
    } else {
      pivot_.reset();
    }
  }
  if (input.drag_began || !drag_pivot_) drag_pivot_ = Pivot();
  if (!window_.Dragging() && input.orbit_px.isZero()) drag_pivot_.reset();
  bool moved = false;
  if (!input.orbit_px.isZero()) {
    navigator_.Orbit(drag_pivot_ ? *drag_pivot_ : Pivot(), -kOrbitPerPx * input.orbit_px.x(), kOrbitPerPx * input.orbit_px.y());
    moved = true;
  }
  if (!input.look_px.isZero()) {
    navigator_.Look(kLookPerPx * input.look_px.x(), -kLookPerPx * input.look_px.y());
    moved = true;
  }
  if (!input.pan_px.isZero()) {
    navigator_.Pan(Pivot(), -input.pan_px.x() / size_px_.x(), input.pan_px.y() / size_px_.y());
    moved = true;
  }
  if (input.dolly_steps != 0) {
    navigator_.Dolly(Pivot(), std::pow(0.9, input.dolly_steps));
    moved = true;
  }
  if (input.zoom_steps != 0) {
    navigator_.Zoom(std::pow(0.93, input.zoom_steps));
    moved = true;
  }
  if (!input.fly.isZero()) {
    const double step = kFlySpeed * dt_s / scene_.normalized_from_world.scale;
    navigator_.Fly(step * input.fly.x(), step * input.fly.y(), step * input.fly.z());
    moved = true;
  }
  if (moved) {
    current_photo_ = -1;
    playing_s_.reset();
  }
  return moved;
}

// The picture and what is over it, without the panel, into the bound framebuffer.
void Viewer::Compose() {
  if (painter_.empty()) return overlay_.PresentNothing(size_px_);
  overlay_.Present(painter_.shown(), painter_.shown_size_px(), size_px_);
  const bool with_path = settings_.path && !path_.keys.empty() && !playing_s_;
  if (!settings_.frusta && !settings_.mesh && !with_path) return;
  const Overlay::Eye eye{Normalized(MakeWindowView(navigator_.state(), size_px_.x(), size_px_.y()), scene_.normalized_from_world),
                         &painter_.shown(), painter_.shown_size_px(), size_px_};
  if (settings_.mesh) overlay_.ProxyEdges(eye, lumigraph_);
  if (with_path) DrawPath(eye);
  if (settings_.frusta) {
    std::vector<Eigen::Vector4f> colors;
    for (std::size_t j = 0; j < scene_.views.size(); ++j) {
      const Eigen::Vector3f c = SourceColor(static_cast<int>(j));
      const bool nearest = static_cast<int>(j) == facts_.nearest_photo;
      colors.emplace_back(nearest ? Eigen::Vector4f(1, 1, 1, 1)
                                  : Eigen::Vector4f(c.x(), c.y(), c.z(), lumigraph_.Has({static_cast<int>(j)}) ? 0.9F : 0.3F));
    }
    constexpr double kFrustumDepth = 0.08;  // normalised: the scene's size is about 1
    overlay_.Frusta(eye, lumigraph_.sources(), colors, kFrustumDepth);
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

void Viewer::Grant(const PanelWishes& wishes) {
  try {
    if (wishes.jump_to) Jump(*wishes.jump_to, false);
    if (wishes.home) Key(GLFW_KEY_HOME);
    if (wishes.proxy) WishProxy(*wishes.proxy);
    if (wishes.screenshot) Key(GLFW_KEY_F12);
    if (wishes.auto_effects) ApplyEffects(effects_, {}, settings_.radiance);
    if (wishes.measure) StartMeasuring();
    const int key = settings_.selected_key;
    const bool selected = key >= 0 && key < static_cast<int>(path_.keys.size());
    const auto index = static_cast<std::size_t>(std::max(key, 0));
    const auto exchange = [&](std::size_t other) {
      if (!selected || other >= path_.keys.size()) return;
      path_.frames = 0;
      std::swap(path_.keys[index].time_s, path_.keys[other].time_s);
      std::swap(path_.keys[index], path_.keys[other]);
      settings_.selected_key = static_cast<int>(other);
    };
    switch (wishes.path) {
      case PathWish::kNone: break;
      case PathWish::kAdd: AddKey({}); break;
      case PathWish::kUpdate: if (selected) ReplaceKey(path_, index, CurrentKey(0)); break;
      case PathWish::kDelete: if (selected) DeleteKey(path_, index); break;
      case PathWish::kEarlier: exchange(index - 1); break;
      case PathWish::kLater: exchange(index + 1); break;
      case PathWish::kJump: JumpToKey(key); break;
      case PathWish::kClear: path_ = {}; break;
      case PathWish::kPlay: StartPlaying(); break;
      case PathWish::kStop: playing_s_.reset(); break;
      case PathWish::kLoad: LoadPath(settings_.path_file.data()); break;
      case PathWish::kSave: SavePath(settings_.path_file.data(), false); break;
      case PathWish::kSaveNerfstudio: SavePath(settings_.path_file.data(), true); break;
    }
    if (wishes.key_time_s && selected && *wishes.key_time_s >= 0 && *wishes.key_time_s <= kMaxPathSeconds)
      settings_.selected_key = static_cast<int>(RetimeKey(path_, index, *wishes.key_time_s));
    if (wishes.path_seconds && *wishes.path_seconds > 0 && *wishes.path_seconds <= kMaxPathSeconds) StretchTo(path_, *wishes.path_seconds);
    if (wishes.path_fps && *wishes.path_fps >= 1 && *wishes.path_fps <= 240) {
      path_.fps = *wishes.path_fps;
      path_.frames = 0;
    }
    if (wishes.path_size_px) {
      path_.width_px = std::clamp(wishes.path_size_px->x(), 0, kMostVideoSide);
      path_.height_px = std::clamp(wishes.path_size_px->y(), 0, kMostVideoSide);
    }
    if (wishes.scrub_s && !path_.keys.empty()) {
      playing_s_.reset();
      navigator_.Set(StateOfKey(PoseOnPath(path_, path_.keys.front().time_s + *wishes.scrub_s)));
      facts_.play_s = *wishes.scrub_s;
    }
    switch (wishes.record) {
      case RecordWish::kNone: break;
      case RecordWish::kPath: StartRecording(VideoName()); break;
      case RecordWish::kLive: StartLiveRecording(VideoName()); break;
      case RecordWish::kStop: FinishRecording(); break;
      case RecordWish::kCancel: CancelRecording(); break;
    }
    PathEdited();
  } catch (const Error& e) {
    Complain(e);
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

    if (Clock::now() > message_until_) facts_.message.clear();
    facts_.nearest_photo = NearestView(scene_, navigator_.state());
    if (painter_.complete() && painter_.painted()) {
      facts_.plan_ms = lumigraph_.statistics().plan_ms;
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
    else
      wait_s = !Settled() || scripted_ || proxy_loading_.valid() ? kLoadingWait_s : kIdleWait_s;
  }

  // What was seen until the window closed is kept.
  if (live_recording_) {
    live_recording_->recorder->Finish();
    while (!live_recording_->recorder->Ended()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    CloseRecording(*live_recording_->recorder);
  }

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

std::string RunViewer(const ViewerOptions& options, ProgressSink& progress) {
  std::vector<ScriptStep> script = ParseScript(options.script);
  if (!options.screenshot.empty()) {
    if (!HasImageExtension(options.screenshot))
      throw UsageError("--screenshot writes a picture: " + options.screenshot.string(), "name it FILE.png");
    ScriptStep wait, shot;
    wait.text = "wait";
    shot.verb = ScriptVerb::kScreenshot;
    shot.word = options.screenshot.string();
    script.push_back(wait);
    script.push_back(shot);
  }
  if (!std::filesystem::exists(options.scene)) throw UsageError("there is no scene at " + options.scene.string());

  const auto start = Clock::now();
  Window window("lumi-view: " + options.scene.filename().string(), options.width_px, options.height_px);
  OpeningProgress opening(progress);
  auto future = std::async(std::launch::async, [&] { return OpenForViewing(options, opening); });
  nlohmann::json j;
  while (future.wait_for(std::chrono::milliseconds(30)) != std::future_status::ready) {
    window.Poll(0);
    if (window.ShouldClose() || InterruptRequested()) opening.Cancel();
    const auto [task, fraction] = opening.Now();
    window.BeginUi();
    DrawOpening(options.scene.string(), task, fraction);
    window.EndUi();
    const Eigen::Vector2i size = window.FramebufferSize();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, size.x(), size.y());
    glClearColor(0.115F, 0.12F, 0.13F, 1);
    glClear(GL_COLOR_BUFFER_BIT);
    window.DrawUi();
    window.Swap();
  }
  try {
    Opened opened = future.get();
    const double opened_s = SecondsSince(start);
    Viewer viewer(options, window, opened, progress, std::move(script));
    j = viewer.Run();
    j["seconds_to_open"] = opened_s;
  } catch (const Interrupted&) {
    if (InterruptRequested()) throw;
    j["frames"] = 0;  // the window was closed while the scene was opened
  }
  return j.dump();
}

}  // namespace lumi
