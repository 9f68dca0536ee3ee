// The viewer's camera path and its playback.
#include <fmt/format.h>

#include <cmath>

#include "render/path/nerfstudio_path.h"
#include "render/path/path_editing.h"
#include "render/viewer/viewer_app.h"

namespace lumi {
namespace {

constexpr double kUsualGap_s = 2;  // between keys that are added one after another
constexpr double kJump_s = 0.6;
constexpr double kKeyDepth = 0.05;  // normalised: of a key's frustum
constexpr int kPathLines = 300;

}  // namespace

// The window's camera as a key: what a frame of the path's shape would show.
PathKey Viewer::CurrentKey(double time_s) const {
  const ViewState& state = steering_.navigator.state();
  const int width = path_.width_px > 0 ? path_.width_px : size_px_.x(),
            height = path_.height_px > 0 ? path_.height_px : size_px_.y();
  PathKey key;
  key.cam_from_world = state.cam_from_world;
  key.vertical_fov_rad = 2 * std::atan(0.5 * height / (WindowFocalPx(state.lens, width, height) * state.lens.aspect));
  key.time_s = time_s;
  return key;
}

ViewState Viewer::StateOfKey(const PathKey& key) const {
  const int width = path_.width_px > 0 ? path_.width_px : size_px_.x(),
            height = path_.height_px > 0 ? path_.height_px : size_px_.y();
  ViewState state;
  state.cam_from_world = key.cam_from_world;
  const double tall = 2 * std::tan(0.5 * key.vertical_fov_rad);
  state.lens.extent = {tall * width / height, tall};
  return state;
}

void Viewer::AddKey(std::optional<double> time_s) {
  const double at = time_s ? *time_s : path_.keys.empty() ? 0 : path_.keys.back().time_s + kUsualGap_s;
  settings_.selected_key = static_cast<int>(InsertKey(path_, CurrentKey(at)));
  PathEdited();
  Say(fmt::format("key {} at {:.2f} s", settings_.selected_key,
                  path_.keys[static_cast<std::size_t>(settings_.selected_key)].time_s));
}

std::size_t Viewer::KeyCalled(double index) const {
  if (index >= static_cast<double>(path_.keys.size()))
    throw UsageError(fmt::format("the path has {} keys, none is called {:.0f}", path_.keys.size(), index));
  return static_cast<std::size_t>(index);
}

void Viewer::JumpToKey(int index) {
  if (index < 0 || index >= static_cast<int>(path_.keys.size())) return;
  playing_s_.reset();
  settings_.selected_key = index;
  const PathKey& key = path_.keys[static_cast<std::size_t>(index)];
  facts_.play_s = key.time_s - path_.keys.front().time_s;
  steering_.navigator.FlyTo(StateOfKey(key), script_.given ? 0 : kJump_s);
}

void Viewer::PathEdited() {
  settings_.selected_key = std::min(settings_.selected_key, static_cast<int>(path_.keys.size()) - 1);
  facts_.path = path_;
}

void Viewer::LoadPath(const std::filesystem::path& file) {
  if (file.empty()) throw UsageError("which file? Its name belongs into the field above");
  path_ = ReadCameraPath(file, PathDetail::kKeyframes);
  settings_.selected_key = 0;
  playing_s_.reset();
  PathEdited();
  Say(fmt::format("{} keys from {}", path_.keys.size(), file.string()));
}

void Viewer::SavePath(const std::filesystem::path& file, bool nerfstudio) {
  if (path_.keys.empty()) throw UsageError("the path has no keys yet");
  const std::filesystem::path wanted =
      !file.empty() ? file : std::filesystem::path(facts_.scene + (nerfstudio ? "-nerfstudio.json" : "-path.json"));
  // An existing path may be overwritten; any other file may not.
  if (std::filesystem::exists(wanted)) {
    try {
      ReadCameraPath(wanted);
    } catch (const InputError&) {
      throw UsageError(wanted.string() + " is no camera path and stays", "choose another name");
    }
  }
  if (nerfstudio)
    WriteNerfstudioPath(wanted, path_, size_px_.x(), size_px_.y());
  else
    WriteCameraPath(wanted, path_);
  if (!script_.given) Say("wrote " + wanted.string());
}

void Viewer::StartPlaying() {
  if (path_.keys.size() < 2) return Say("a path to play has two keys or more");
  playing_s_ = 0;
}

bool Viewer::Play(double dt_s) {
  bool changed = false;
  if (playing_s_ && path_.keys.empty()) playing_s_.reset();
  if (playing_s_) {
    steering_.navigator.Set(StateOfKey(PoseOnPath(path_, path_.keys.front().time_s + *playing_s_)));
    facts_.play_s = *playing_s_;
    if (*playing_s_ >= Duration(path_))
      playing_s_.reset();
    else
      *playing_s_ = std::min(*playing_s_ + dt_s, Duration(path_));
    changed = true;
  }
  facts_.playing = playing_s_.has_value();
  RadianceSettings& s = settings_.radiance;
  if (settings_.play_time && s.time && facts_.times.second > facts_.times.first) {
    const double first = facts_.period_s > 0 ? 0 : facts_.times.first,
                 span = facts_.period_s > 0 ? facts_.period_s : facts_.times.second - first;
    s.time_s = first + std::fmod(s.time_s + dt_s - first + span, span);
    changed = true;
  }
  return changed;
}

void Viewer::DrawPath(const Overlay::Eye& eye) {
  const Similarity3& normalized = scene_.normalized_from_world;
  std::vector<Overlay::Line> lines;
  const auto at = [&](double t) {
    return Eigen::Vector3d(normalized * PoseOnPath(path_, t).cam_from_world.OriginInSource());
  };
  const double start = path_.keys.front().time_s, duration = Duration(path_);
  Eigen::Vector3d last = at(start);
  for (int i = 1; i <= kPathLines && duration > 0; ++i) {
    const Eigen::Vector3d next = at(start + duration * i / kPathLines);
    lines.push_back({last, next, {1.0F, 0.75F, 0.25F, 0.9F}});
    last = next;
  }
  for (std::size_t k = 0; k < path_.keys.size(); ++k) {
    const PathKey& key = path_.keys[k];
    const bool chosen = static_cast<int>(k) == settings_.selected_key;
    const Eigen::Vector4f color = chosen ? Eigen::Vector4f(1, 1, 1, 1) : Eigen::Vector4f(1.0F, 0.75F, 0.25F, 0.9F);
    const RenderView view = Normalized(MakeRenderView(key, eye.window_px.x(), eye.window_px.y()), normalized);
    if ((view.centre - eye.view.centre).norm() < 2 * kKeyDepth) continue;  // its frustum would cover the picture
    Overlay::AddFrustum(view, kKeyDepth, color, lines);
  }
  overlay_.Lines(eye, lines);
}

}  // namespace lumi
