// The viewer's camera path and its playback, recording, and measuring.
#include <epoxy/gl.h>
#include <fmt/format.h>

#include <cmath>

#include "render/convert.h"
#include "render/path/nerfstudio_path.h"
#include "render/path/path_editing.h"
#include "render/viewer/canvas.h"
#include "render/viewer/setting_rules.h"
#include "render/viewer/viewer_app.h"

namespace lumi {
namespace {

constexpr double kUsualGap_s = 2;        // between keys that are added one after another
constexpr double kJump_s = 0.6;
constexpr double kStep_ms = 40;          // of a job, before the window is looked at again
constexpr double kJobPatience_s = 0.3;   // a job that the moving picture kept from working draws one of its pictures whole
constexpr double kLiveFps = 30;
constexpr double kKeyDepth = 0.05;       // normalised: of a key's frustum
constexpr int kPathLines = 300;

// Of a recording of what is seen, by now.
long FramesDue(Clock::time_point start) { return static_cast<long>(SecondsSince(start) * kLiveFps) + 1; }

}  // namespace

// The window's camera as a key: what a frame of the path's shape would show.
PathKey Viewer::CurrentKey(double time_s) const {
  const ViewState& state = navigator_.state();
  const int width = path_.width_px > 0 ? path_.width_px : size_px_.x(), height = path_.height_px > 0 ? path_.height_px : size_px_.y();
  PathKey key;
  key.cam_from_world = state.cam_from_world;
  key.vertical_fov_rad = 2 * std::atan(0.5 * height / (WindowFocalPx(state.lens, width, height) * state.lens.aspect));
  key.time_s = time_s;
  return key;
}

ViewState Viewer::StateOfKey(const PathKey& key) const {
  const int width = path_.width_px > 0 ? path_.width_px : size_px_.x(), height = path_.height_px > 0 ? path_.height_px : size_px_.y();
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
  Say(fmt::format("key {} at {:.2f} s", settings_.selected_key, path_.keys[static_cast<std::size_t>(settings_.selected_key)].time_s));
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
  navigator_.FlyTo(StateOfKey(key), scripted_ ? 0 : kJump_s);
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
  // A path is written over by its user's own word; what is no path is not.
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
  if (!scripted_) Say("wrote " + wanted.string());
}

void Viewer::StartPlaying() {
  if (path_.keys.size() < 2) return Say("a path to play has two keys or more");
  playing_s_ = 0;
}

bool Viewer::Play(double dt_s) {
  bool changed = false;
  if (playing_s_ && path_.keys.empty()) playing_s_.reset();
  if (playing_s_) {
    navigator_.Set(StateOfKey(PoseOnPath(path_, path_.keys.front().time_s + *playing_s_)));
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
  const auto at = [&](double t) { return Eigen::Vector3d(normalized * PoseOnPath(path_, t).cam_from_world.OriginInSource()); };
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
    const Rigid3 world_from_cam = key.cam_from_world.Inverse();
    const double h = std::tan(0.5 * key.vertical_fov_rad), w = h * eye.window_px.x() / eye.window_px.y(),
                 depth = kKeyDepth / normalized.scale;
    const Eigen::Vector3d centre = normalized * world_from_cam.translation;
    if ((centre - eye.view.centre).norm() < 2 * kKeyDepth) continue;  // its lines would run through the picture
    Eigen::Vector3d corner[4];
    int i = 0;
    for (const Eigen::Vector2d& c : {Eigen::Vector2d(-w, -h), Eigen::Vector2d(w, -h), Eigen::Vector2d(w, h), Eigen::Vector2d(-w, h)})
      corner[i++] = normalized * Eigen::Vector3d(world_from_cam * Eigen::Vector3d(depth * c.x(), depth * c.y(), depth));
    for (int c = 0; c < 4; ++c) {
      lines.push_back({centre, corner[c], color});
      lines.push_back({corner[c], corner[(c + 1) % 4], color});
    }
  }
  overlay_.Lines(eye, lines);
}

std::filesystem::path Viewer::VideoName() const {
  std::string name = settings_.video_file.data();
  if (name.empty()) name = facts_.scene + ".mp4";
  if (std::filesystem::path(name).extension() != ".mp4") name += ".mp4";
  return name;
}

void Viewer::StartRecording(const std::filesystem::path& wanted) {
  if (path_recording_ || live_recording_) throw UsageError("a recording is going on");
  if (path_.keys.size() < 2) throw UsageError("a path to record has two keys or more");
  auto r = std::make_unique<PathRecording>(PathRecording{nullptr, StripPainter(lumigraph_), path_, Request({1, 1}, accepted_), {}, 0});
  r->size_px = {path_.width_px > 0 ? path_.width_px : size_px_.x(), path_.height_px > 0 ? path_.height_px : size_px_.y()};
  r->recorder = std::make_unique<Recorder>(wanted, path_.fps);
  facts_.recording_to = wanted.string();
  playing_s_.reset();
  path_recording_ = std::move(r);
}

void Viewer::StartLiveRecording(const std::filesystem::path& wanted) {
  if (path_recording_ || live_recording_) throw UsageError("a recording is going on");
  auto r = std::make_unique<LiveRecording>();
  r->recorder = std::make_unique<Recorder>(wanted, kLiveFps);
  r->start = Clock::now();
  r->size_px = size_px_;
  facts_.recording_to = wanted.string();
  live_recording_ = std::move(r);
}

void Viewer::FinishRecording() {
  // Frames that the encoder had no room for are made up now: the clip lasts as long as what was seen.
  if (live_recording_) live_recording_->recorder->Finish(FramesDue(live_recording_->start));
}

void Viewer::CancelRecording() {
  if (path_recording_) path_recording_->recorder->Cancel();
  if (live_recording_) live_recording_->recorder->Cancel();
}

// Called with what is seen in the bound framebuffer: drawn once more into one that nothing covers.
void Viewer::StepLiveRecording() {
  if (!live_recording_) return;
  LiveRecording& r = *live_recording_;
  if (r.recorder->state() == Recorder::State::kOpen) {
    if (r.size_px != size_px_) {
      // A video has one size.
      r.recorder->Finish(FramesDue(r.start));
      Say("the window's size changed: the recording ends here");
    } else {
      const long due = FramesDue(r.start);
      if (r.recorder->added() < due && !r.recorder->Full()) {
        const Canvas canvas(size_px_);
        Compose();
        const Image8 seen = canvas.Read();
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        // As often as its time on the screen: the clip runs as the hand did. What the encoder has no room for comes later.
        while (r.recorder->added() < due && !r.recorder->Full()) r.recorder->Add(seen);
      }
    }
  }
  if (!r.recorder->Ended()) return;
  const std::unique_ptr<LiveRecording> ended = std::move(live_recording_);
  try {
    CloseRecording(*ended->recorder);
  } catch (const Error& e) {
    Complain(e);
  }
}

void Viewer::StepPathRecording(double step_ms, bool undisturbed) {
  PathRecording& r = *path_recording_;
  const int count = FrameCount(r.path);
  facts_.recorded = static_cast<double>(r.recorder->encoded()) / std::max(1, count);
  if (r.recorder->state() == Recorder::State::kOpen && !Loading()) {
    if (!r.painter.busy() && r.next < count && !r.recorder->Full()) {
      const double start = r.path.keys.front().time_s, t = count > 1 ? Duration(r.path) * r.next / (count - 1) : 0;
      RenderRequest request = r.request;
      request.view = MakeRenderView(PoseOnPath(r.path, start + t), r.size_px.x(), r.size_px.y());
      // Where time plays, it plays in the video as well.
      if (settings_.play_time) request.settings.time_s += t;
      r.painter.Start(request);
      ++r.next;
    }
    if (r.painter.busy()) {
      painter_.Disturbed();
      if (const auto picture = r.painter.Step(step_ms, undisturbed)) {
        r.recorder->Add(ToRgb8(*picture));
        if (r.next == count) r.recorder->Finish();
      }
    }
  }
  if (r.recorder->Ended()) {
    const std::unique_ptr<PathRecording> ended = std::move(path_recording_);
    CloseRecording(*ended->recorder);
  }
}

void Viewer::CloseRecording(const Recorder& recorder) {
  switch (recorder.state()) {
    case Recorder::State::kWritten:
      videos_.emplace_back(recorder.file().string(), recorder.encoded());
      if (!scripted_) Say("wrote " + recorder.file().string());
      break;
    case Recorder::State::kFailed: throw MachineError(recorder.problem(), {}, facts_.recording_to);
    default: Say("the recording was cancelled: nothing is left of it");
  }
}

void Viewer::StartMeasuring() {
  if (probe_.busy() || path_recording_) return;
  probe_.Start(ViewId{NearestView(scene_, navigator_.state())}, accepted_);
}

// What is drawn beside the picture, a step a frame; while the picture itself is redrawn, it waits for a while.
void Viewer::StepJobs() {
  const bool undisturbed = !painter_.painted();
  const bool step = undisturbed || SecondsSince(last_step_) > kJobPatience_s;
  const double step_ms = undisturbed ? kStep_ms : 0;
  try {
    if (step && path_recording_) StepPathRecording(step_ms, undisturbed);
    if (step && probe_.busy() && !path_recording_ && !Loading()) {
      if (probe_.drawing()) painter_.Disturbed();
      if (auto measured = probe_.Step(step_ms, undisturbed)) {
        ShowDifference(measured->difference);
        measured->difference = {};
        errors_.push_back(*measured);
        facts_.errors.push_back({measured->photo, Describe(measured->settings), measured->psnr_db, measured->coverage, measured->ms});
      }
    }
    if (undisturbed && !Working()) StepBudgetProbe();
  } catch (const Error& e) {
    path_recording_.reset();
    Complain(e);
  }
  if (step) last_step_ = Clock::now();
  facts_.measuring = probe_.busy();
  facts_.recording = path_recording_ || live_recording_;
  facts_.recording_live = live_recording_ != nullptr;
  if (live_recording_) facts_.recorded = SecondsSince(live_recording_->start);
}

}  // namespace lumi
