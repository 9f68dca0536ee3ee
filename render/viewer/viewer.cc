#include "render/viewer/viewer.h"

#include <epoxy/gl.h>

#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <future>

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

}  // namespace

RenderRequest Viewer::Request(const Eigen::Vector2i& size_px) const {
  RenderRequest r;
  r.view = MakeWindowView(navigator_.state(), size_px.x(), size_px.y());
  r.settings = settings_.radiance;
  r.show = settings_.show;
  return r;
}

static bool Same(const RenderRequest& a, const RenderRequest& b) {
  const RadianceSettings &s = a.settings, &t = b.settings;
  return a.view.P == b.view.P && a.view.size_px == b.view.size_px && a.show == b.show && s.k == t.k &&
         s.gamma == t.gamma && s.fov_feather == t.fov_feather && s.visibility == t.visibility && s.prefilter == t.prefilter;
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
  proxy_loading_ = std::async(std::launch::async, [this, name] { return std::pair(name, LoadProxy(scene_, name)); });
}

void Viewer::TakeProxy() {
  facts_.proxy_loading = proxy_loading_.valid();
  if (!facts_.proxy_loading || proxy_loading_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  try {
    const auto [name, mesh] = proxy_loading_.get();
    SetProxy(mesh, name);
  } catch (const Error& e) {
    if (scripted_) throw;
    Say(e.what());
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
  if (moved) current_photo_ = -1;
  return moved;
}

// The picture and what is over it, without the panel, into the bound framebuffer.
void Viewer::Compose() {
  overlay_.Present(painter_.shown(), painter_.shown_size_px(), size_px_);
  if (!settings_.frusta && !settings_.mesh) return;
  const Overlay::Eye eye{Normalized(MakeWindowView(navigator_.state(), size_px_.x(), size_px_.y()), scene_.normalized_from_world),
                         &painter_.shown(), painter_.shown_size_px(), size_px_};
  if (settings_.mesh) overlay_.ProxyEdges(eye, lumigraph_);
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
    bool moving = Steer(window_.Take(), dt);
    moving |= navigator_.Tick(dt);
    if (scripted_) RunScript();
    loader_.SetFocus(navigator_.state().cam_from_world);

    const RenderRequest request = Request(size_px_);
    const bool changed = !drawn_ || !Same(*drawn_, request) || drawn_generation_ != generation_;
    painter_.Paint(request, Request(painter_.PreviewSize(size_px_)), changed, !Loading());
    drawn_ = request;
    drawn_generation_ = generation_;

    if (Clock::now() > message_until_) facts_.message.clear();
    facts_.nearest_photo = NearestView(scene_, navigator_.state());
    facts_.picture_ms = painter_.picture_ms();
    facts_.complete = painter_.complete();
    facts_.scale = static_cast<double>(painter_.shown_size_px().x()) / size_px_.x();
    window_.BeginUi();
    if (options_.show_ui) {
      const PanelWishes wishes = DrawPanel(facts_, settings_);
      if (wishes.jump_to) Jump(*wishes.jump_to, false);
      if (wishes.home) Key(GLFW_KEY_HOME);
      if (wishes.proxy) WishProxy(*wishes.proxy);
      if (wishes.screenshot) Key(GLFW_KEY_F12);
      if (window_.Dragging() && drag_pivot_)
        if (const auto x = Project(request.view.P, *drag_pivot_))
          DrawPivot(x->x(), x->y(), 1.0);
    }
    window_.EndUi();
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    Compose();
    window_.DrawUi();
    window_.Swap();
    ++frames;

    const double ms = 1000 * SecondsSince(last);
    if (painter_.painted()) frame_ms_.push_back(ms);
    facts_.frame_ms = facts_.frame_ms == 0 ? ms : 0.9 * facts_.frame_ms + 0.1 * ms;
    if (scripted_) {
      AfterPainting();
      if (script_.empty()) break;
    }
    const bool refining = !painter_.complete() && !Loading();
    if (moving || changed || refining || navigator_.flying() || window_.Dragging())
      wait_s = 0;
    else
      wait_s = Loading() || scripted_ || proxy_loading_.valid() ? kLoadingWait_s : kIdleWait_s;
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
