// How mouse, keys and panel steer the viewer.
#include <epoxy/gl.h>

#include <GLFW/glfw3.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/viewer/viewer_app.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kFlight_s = 0.9;
constexpr double kOrbitPerPx = 0.006, kLookPerPx = 0.0025;  // radians
constexpr double kFlySpeed = 0.6;                           // scene sizes a second

}  // namespace

// The proxy's point at a pixel of the window.
std::optional<Eigen::Vector3d> Viewer::PointAt(double x_px, double y_px) const {
  if (painter_.empty()) return std::nullopt;
  const Eigen::Vector2d scale = painter_.shown_size_px().cast<double>().cwiseQuotient(size_px_.cast<double>());
  const int x = std::clamp(static_cast<int>(x_px * scale.x()), 0, painter_.shown_size_px().x() - 1);
  const int y = std::clamp(static_cast<int>(y_px * scale.y()), 0, painter_.shown_size_px().y() - 1);
  const double depth = static_cast<double>(gl_.ReadDepth(painter_.shown(), x, y));
  if (!(depth > 0)) return std::nullopt;
  const RenderView view = MakeWindowView(steering_.navigator.state(), size_px_.x(), size_px_.y());
  const Eigen::Matrix3d M = view.P.leftCols<3>();
  const auto ray = RayDirection(view.P, {x_px, y_px});
  if (!ray) return std::nullopt;
  // The depth is along the optical axis, in normalised units.
  const Eigen::Vector3d to_depth_one = *ray * (M.row(2).norm() / M.row(2).dot(*ray));
  return view.centre + to_depth_one * (depth / scene_.normalized_from_world.scale);
}

// What an orbit turns about: the picked point, else what stands in the middle of the picture, else the scene's centre.
Eigen::Vector3d Viewer::Pivot() {
  if (steering_.pivot) return *steering_.pivot;
  if (const auto middle = PointAt(0.5 * size_px_.x(), 0.5 * size_px_.y())) return *middle;
  return scene_.normalized_from_world.Inverse() * Eigen::Vector3d::Zero();
}

void Viewer::Jump(int view, bool at_once) {
  const int n = static_cast<int>(scene_.views.size());
  steering_.current_photo = (view % n + n) % n;
  steering_.navigator.FlyTo(StateOfView(scene_, ViewId{steering_.current_photo}), at_once ? 0 : kFlight_s);
}

void Viewer::Key(int key) {
  if (SeenKey(key, settings_.seen)) return;
  if (PhotosKey(key, settings_.radiance))
    return Say(settings_.radiance.k == 0 ? "all photos at every pixel"
                                         : fmt::format("{} photos a pixel", settings_.radiance.k));
  const int current = steering_.current_photo >= 0 ? steering_.current_photo
                                                   : NearestView(scene_, steering_.navigator.state().cam_from_world);
  switch (key) {
    case GLFW_KEY_ESCAPE: return window_.Close();
    case GLFW_KEY_B: settings_.fill = !settings_.fill; return;
    case GLFW_KEY_C: settings_.frusta = !settings_.frusta; return;
    case GLFW_KEY_P: settings_.mesh = !settings_.mesh; return;
    case GLFW_KEY_N:
      if (const auto at = std::find(facts_.proxies.begin(), facts_.proxies.end(), facts_.proxy);
          facts_.proxies.size() > 1) {
        const std::string next =
            at == facts_.proxies.end() || at + 1 == facts_.proxies.end() ? facts_.proxies.front() : *(at + 1);
        WishProxy(next);
        Say("proxy " + next);
      }
      return;
    case GLFW_KEY_K: return AddKey({});
    case GLFW_KEY_M: return Mark(cursor_px_);
    case GLFW_KEY_SPACE:
      if (playing_s_)
        playing_s_.reset();
      else
        StartPlaying();
      return;
    case GLFW_KEY_H: settings_.help = !settings_.help; return;
    case GLFW_KEY_TAB: settings_.panel = !settings_.panel; return;
    case GLFW_KEY_LEFT: return Jump(current - 1, false);
    case GLFW_KEY_RIGHT: return Jump(current + 1, false);
    case GLFW_KEY_HOME:
      steering_.pivot.reset();
      steering_.current_photo = -1;
      return steering_.navigator.FlyTo(steering_.home, kFlight_s);
    case GLFW_KEY_F12: return painter_.empty() ? void() : Screenshot(FreeScreenshotName(), false);
    default: return;
  }
}

// Returns whether the user moves the camera.
bool Viewer::Move(const WindowInput& input, double dt_s) {
  cursor_px_ = input.cursor_px;
  try {
    for (const int key : input.keys) Key(key);
  } catch (const Error& e) {
    Complain(e);  // a folder that cannot be written ends no path and no recording
  }
  if (input.double_click_px) {
    if (const auto point = PointAt(input.double_click_px->x(), input.double_click_px->y())) {
      steering_.pivot = point;
      Say("orbits turn about this point");
    } else {
      steering_.pivot.reset();
    }
  }
  if (input.drag_began || !steering_.drag_pivot) steering_.drag_pivot = Pivot();
  if (!window_.Dragging() && input.orbit_px.isZero()) steering_.drag_pivot.reset();
  bool moved = false;
  if (!input.orbit_px.isZero()) {
    steering_.navigator.Orbit(steering_.drag_pivot ? *steering_.drag_pivot : Pivot(), -kOrbitPerPx * input.orbit_px.x(),
                              kOrbitPerPx * input.orbit_px.y());
    moved = true;
  }
  if (!input.look_px.isZero()) {
    steering_.navigator.Look(kLookPerPx * input.look_px.x(), -kLookPerPx * input.look_px.y());
    moved = true;
  }
  if (!input.pan_px.isZero()) {
    steering_.navigator.Pan(Pivot(), -input.pan_px.x() / size_px_.x(), input.pan_px.y() / size_px_.y());
    moved = true;
  }
  if (input.dolly_steps != 0) {
    steering_.navigator.Dolly(Pivot(), std::pow(0.9, input.dolly_steps));
    moved = true;
  }
  if (input.zoom_steps != 0) {
    steering_.navigator.Zoom(std::pow(0.93, input.zoom_steps));
    moved = true;
  }
  if (!input.fly.isZero()) {
    const double step = kFlySpeed * dt_s / scene_.normalized_from_world.scale;
    steering_.navigator.Fly(step * input.fly.x(), step * input.fly.y(), step * input.fly.z());
    moved = true;
  }
  if (moved) {
    steering_.current_photo = -1;
    playing_s_.reset();
  }
  return moved;
}

void Viewer::Grant(const PanelWishes& wishes) {
  try {
    if (wishes.jump_to) Jump(*wishes.jump_to, false);
    if (wishes.home) Key(GLFW_KEY_HOME);
    if (wishes.proxy) WishProxy(*wishes.proxy);
    if (wishes.screenshot) Key(GLFW_KEY_F12);
    if (wishes.auto_effects) ApplyEffects(effects_, {}, settings_.radiance);
    if (wishes.measure) StartMeasuring();
    if (wishes.distance_m) SetScale(*wishes.distance_m);
    for (const ScriptStep& s : wishes.path)
      if (s.verb == ScriptVerb::kPathSize || InRange(s)) RunPathStatement(s);  // 0: the window's size
    const auto key = static_cast<std::size_t>(settings_.selected_key),
               other = static_cast<std::size_t>(wishes.exchange_key.value_or(-1));
    if (std::max(key, other) < path_.keys.size()) {
      path_.frames = 0;
      std::swap(path_.keys[key].time_s, path_.keys[other].time_s);
      std::swap(path_.keys[key], path_.keys[other]);
      settings_.selected_key = *wishes.exchange_key;
    }
    if (wishes.play && *wishes.play)
      StartPlaying();
    else if (wishes.play)
      playing_s_.reset();
    if (wishes.scrub_s && !path_.keys.empty()) {
      playing_s_.reset();
      steering_.navigator.Set(StateOfKey(PoseOnPath(path_, path_.keys.front().time_s + *wishes.scrub_s)));
      facts_.play_s = *wishes.scrub_s;
    }
    switch (wishes.record) {
      case RecordWish::kNone: break;
      case RecordWish::kPath: StartRecording(VideoName()); break;
      case RecordWish::kLive: StartLiveRecording(VideoName()); break;
      case RecordWish::kStop: FinishRecording(); break;
      case RecordWish::kCancel: CancelRecording(); break;
    }
    if (wishes.export_page) StartExport(PageName());
    PathEdited();
  } catch (const Error& e) {
    Complain(e);
  }
}

}  // namespace lumi
