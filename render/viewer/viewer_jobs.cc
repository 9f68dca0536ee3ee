// What the viewer draws beside the picture: videos, and a photo's view that an error is measured at.
#include <epoxy/gl.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "render/picture/border_fill.h"
#include "render/picture/convert.h"
#include "render/viewer/canvas.h"
#include "render/viewer/viewer_app.h"

namespace lumi {
namespace {

constexpr double kStep_ms = 40;  // of a job, before the next frame of the window
constexpr double kJobPatience_s =
    0.3;  // a job that the moving picture blocked for so long draws one of its pictures in one go
constexpr double kLiveFps = 30;

// Frames that a live recording should have by now.
long FramesDue(Clock::time_point start) { return static_cast<long>(SecondsSince(start) * kLiveFps) + 1; }

}  // namespace

std::filesystem::path Viewer::VideoName() const {
  std::string name = settings_.video_file.data();
  if (name.empty()) name = facts_.scene + ".mp4";
  if (std::filesystem::path(name).extension() != ".mp4") name += ".mp4";
  return name;
}

void Viewer::StartRecording(const std::filesystem::path& wanted) {
  if (jobs_.path_recording || jobs_.live_recording) throw UsageError("a recording is going on");
  if (path_.keys.size() < 2) throw UsageError("a path to record has two keys or more");
  auto r = std::make_unique<PathRecording>(
      PathRecording{nullptr, StripPainter(gl_), path_, Request({1, 1}, drawn_.settings), {}, 0, settings_.Fills()});
  r->size_px = {path_.width_px > 0 ? path_.width_px : size_px_.x(),
                path_.height_px > 0 ? path_.height_px : size_px_.y()};
  r->recorder = std::make_unique<Recorder>(wanted, path_.fps);
  facts_.recording_to = wanted.string();
  playing_s_.reset();
  jobs_.path_recording = std::move(r);
}

void Viewer::StartLiveRecording(const std::filesystem::path& wanted) {
  if (jobs_.path_recording || jobs_.live_recording) throw UsageError("a recording is going on");
  auto r = std::make_unique<LiveRecording>();
  r->recorder = std::make_unique<Recorder>(wanted, kLiveFps);
  r->start = Clock::now();
  r->size_px = size_px_;
  facts_.recording_to = wanted.string();
  jobs_.live_recording = std::move(r);
}

void Viewer::FinishRecording() {
  // Frames that the encoder had no room for are added now, so that the clip lasts as long as the recording did.
  if (jobs_.live_recording) jobs_.live_recording->recorder->Finish(FramesDue(jobs_.live_recording->start));
}

void Viewer::CancelRecording() {
  if (jobs_.path_recording) jobs_.path_recording->recorder->Cancel();
  if (jobs_.live_recording) jobs_.live_recording->recorder->Cancel();
}

// Draws the picture again into a framebuffer that no other window covers.
void Viewer::StepLiveRecording() {
  if (!jobs_.live_recording) return;
  LiveRecording& r = *jobs_.live_recording;
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
        // Repeats the frame for its time on the screen, so that the clip runs in real time. Frames that the encoder has
        // no room for are added later.
        while (r.recorder->added() < due && !r.recorder->Full()) r.recorder->Add(seen);
      }
    }
  }
  if (!r.recorder->Ended()) return;
  const std::unique_ptr<LiveRecording> ended = std::move(jobs_.live_recording);
  try {
    CloseRecording(*ended->recorder);
  } catch (const Error& e) {
    Complain(e);
  }
}

void Viewer::StepPathRecording(double step_ms, bool undisturbed) {
  PathRecording& r = *jobs_.path_recording;
  const int count = FrameCount(r.path);
  facts_.recorded = static_cast<double>(r.recorder->encoded()) / std::max(1, count);
  if (r.recorder->state() == Recorder::State::kOpen && !Loading()) {
    if (!r.painter.busy() && r.next < count && !r.recorder->Full()) {
      const double start = r.path.keys.front().time_s, t = count > 1 ? Duration(r.path) * r.next / (count - 1) : 0;
      RenderRequest request = r.request;
      request.view = MakeRenderView(PoseOnPath(r.path, start + t), r.size_px.x(), r.size_px.y());
      // If time plays in the window, it also plays in the video.
      if (settings_.play_time) request.settings.time_s += t;
      if (!PhotosAreHere(request)) return;
      r.painter.Start(request);
      ++r.next;
    }
    if (r.painter.busy()) {
      painter_.Disturbed();
      if (auto picture = r.painter.Step(step_ms, undisturbed)) {
        if (r.fill) FillSmoothly(*picture);
        r.recorder->Add(ToRgb8(*picture));
        if (r.next == count) r.recorder->Finish();
      }
    }
  }
  if (r.recorder->Ended()) {
    const std::unique_ptr<PathRecording> ended = std::move(jobs_.path_recording);
    CloseRecording(*ended->recorder);
  }
}

void Viewer::CloseRecording(const Recorder& recorder) {
  switch (recorder.state()) {
    case Recorder::State::kWritten:
      jobs_.videos.push_back({recorder.file().string(), recorder.encoded()});
      if (!script_.given) Say("wrote " + recorder.file().string());
      break;
    case Recorder::State::kFailed: throw MachineError(recorder.problem(), {}, facts_.recording_to);
    default: Say("the recording was cancelled: nothing is left of it");
  }
}

// In the scene's folder, if that is a scene of ours.
std::filesystem::path Viewer::PageName() const {
  std::error_code ec;
  if (std::filesystem::exists(scene_.folder / "lumigraph.json", ec)) return scene_.folder / "web.html";
  return FreeName(facts_.scene + ".html");
}

// Those that are seen; auto where they are what the data call for, or are not all known yet.
std::string Viewer::EffectsOfPage() const {
  if (options_.effects == "auto") {
    RadianceSettings called_for = settings_.radiance;
    ApplyEffects(effects_, {}, called_for);
    if (facts_.effects_open || EffectListOf(called_for) == EffectListOf(settings_.radiance)) return "auto";
  }
  return EffectListOf(settings_.radiance);
}

void Viewer::StartExport(const std::filesystem::path& file) {
  if (jobs_.page_export) throw UsageError("a web page is being made");
  const bool in_scene = std::ranges::find(facts_.proxies, facts_.proxy) != facts_.proxies.end();
  jobs_.page_export =
      std::make_unique<PageExport>(scene_.folder, in_scene ? facts_.proxy : options_.proxy, EffectsOfPage(), file);
}

void Viewer::StepExport() {
  facts_.exporting = jobs_.page_export ? jobs_.page_export->task() : std::string();
  if (!jobs_.page_export || !jobs_.page_export->ended()) return;
  const std::unique_ptr<PageExport> ended = std::move(jobs_.page_export);
  facts_.exporting.clear();
  try {
    const double mb = ended->Result();
    if (!script_.given) Say(fmt::format("wrote {}, {:.1f} MB", ended->file().string(), mb));
  } catch (const Error& e) {
    Complain(e);
  }
}

void Viewer::StartMeasuring() {
  if (jobs_.probe.busy() || jobs_.path_recording) return;
  jobs_.probe.Start(ViewId{NearestView(scene_, steering_.navigator.state().cam_from_world)}, drawn_.settings);
}

// Draws one step of the jobs per frame; while the picture itself is redrawn, jobs wait up to kJobPatience_s.
void Viewer::StepJobs() {
  const bool undisturbed = !painter_.painted();
  const bool step = undisturbed || SecondsSince(jobs_.last_step) > kJobPatience_s;
  const double step_ms = undisturbed ? kStep_ms : 0;
  try {
    if (step && jobs_.path_recording) StepPathRecording(step_ms, undisturbed);
    if (step && jobs_.probe.busy() && !jobs_.path_recording && PhotosAreHere(jobs_.probe.Request()) && !Loading()) {
      if (jobs_.probe.drawing()) painter_.Disturbed();
      if (auto measured = jobs_.probe.Step(step_ms, undisturbed)) {
        ShowDifference(measured->difference);
        measured->difference = {};
        facts_.errors.push_back(*measured);
      }
    }
    if (undisturbed && !Working()) StepBudgetProbe();
  } catch (const Error& e) {
    jobs_.path_recording.reset();
    Complain(e);
  }
  StepExport();
  if (step) jobs_.last_step = Clock::now();
  facts_.measuring = jobs_.probe.busy();
  facts_.recording = jobs_.path_recording || jobs_.live_recording;
  facts_.recording_live = jobs_.live_recording != nullptr;
  if (jobs_.live_recording) facts_.recorded = SecondsSince(jobs_.live_recording->start);
}

bool Viewer::RunRecordingStatement(const ScriptStep& s) {
  switch (s.verb) {
    case ScriptVerb::kRecord:
    case ScriptVerb::kRecordStart:
      // Waits until the settings of earlier statements are drawn.
      if (!script_.waiting && (!Settled() || !painter_.complete() || !(drawn_.settings == Drawn() || drawn_.refused)))
        return false;
      if (!script_.waiting) StartRecording(s.word);
      script_.waiting = true;
      return s.verb == ScriptVerb::kRecordStart || !jobs_.path_recording;
    case ScriptVerb::kRecordLive: StartLiveRecording(s.word); return true;
    case ScriptVerb::kRecordStop: FinishRecording(); break;
    case ScriptVerb::kRecordCancel: CancelRecording(); break;
    default: break;
  }
  return !jobs_.live_recording && !jobs_.path_recording;
}

}  // namespace lumi
