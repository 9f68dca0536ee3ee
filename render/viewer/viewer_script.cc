// How a script steers the viewer.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "render/path/path_editing.h"
#include "render/settings_json.h"
#include "render/viewer/setting_rules.h"
#include "render/viewer/viewer_app.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

constexpr double kScriptPatience_s = 900;  // for a 'wait'

}  // namespace

// Runs statements up to one that has to wait; those that wait for a picture go on in AfterPainting.
void Viewer::RunScript() {
  while (!script_.empty()) {
    if (!RunStatement(script_.front())) return;
    waiting_ = false;
    script_.pop_front();
  }
}

bool Viewer::RunStatement(const ScriptStep& s) {
  const auto rad = [&](std::size_t i) { return s.numbers[i] * kRadPerDeg; };
  RadianceSettings& radiance = settings_.radiance;
  switch (s.verb) {
    case ScriptVerb::kJump: Jump(FindView(scene_, s.word), true); break;
    case ScriptVerb::kFlyTo:
      if (!waiting_) Jump(FindView(scene_, s.word), false);
      waiting_ = true;
      return !navigator_.flying();
    case ScriptVerb::kHome: navigator_.Set(home_); break;
    case ScriptVerb::kOrbit:
      // The point in the middle of a picture that is not drawn yet is not known.
      if (painter_.empty()) return false;
      navigator_.Orbit(Pivot(), rad(0), rad(1));
      navigator_.LevelAtOnce();
      break;
    case ScriptVerb::kLook:
      navigator_.Look(rad(0), rad(1));
      navigator_.LevelAtOnce();
      break;
    case ScriptVerb::kMove: {
      const double size = 1.0 / scene_.normalized_from_world.scale;
      navigator_.Fly(size * s.numbers[0], size * s.numbers[1], size * s.numbers[2]);
      break;
    }
    case ScriptVerb::kDolly:
      if (painter_.empty()) return false;
      navigator_.Dolly(Pivot(), s.numbers[0]);
      break;
    case ScriptVerb::kZoom: navigator_.Zoom(s.numbers[0]); break;
    case ScriptVerb::kK: radiance.k = s.word == "all" ? 0 : std::stoi(s.word); break;
    case ScriptVerb::kSet:
      SetOption(radiance, s.word, s.value);
      decided_.insert(s.word);
      Reconcile(radiance, s.word);
      break;
    case ScriptVerb::kEffects:
      if (!Settled()) return false;  // the data's word comes first
      SetEffects(s.word, effects_, radiance);
      break;
    case ScriptVerb::kShow:
      settings_.seen = *SeenFromName(s.word);
      break;
    case ScriptVerb::kFrusta: settings_.frusta = s.word == "on"; break;
    case ScriptVerb::kMesh: settings_.mesh = s.word == "on"; break;
    case ScriptVerb::kPath: settings_.path = s.word == "on"; break;
    case ScriptVerb::kPanel: settings_.panel = s.word == "on"; break;
    case ScriptVerb::kOpen:
    case ScriptVerb::kClose: {
      const auto& names = PanelGroups();
      if (std::find(names.begin(), names.end(), s.word) == names.end())
        throw UsageError(fmt::format("the panel has no group '{}'", s.word), fmt::format("there are: {}", fmt::join(names, ", ")));
      settings_.groups[s.word] = s.verb == ScriptVerb::kOpen;
      break;
    }
    case ScriptVerb::kProxy:
      if (!waiting_) WishProxy(s.word);
      waiting_ = true;
      return !proxy_loading_.valid();
    case ScriptVerb::kBudget: settings_.budget_ms = s.numbers[0]; break;
    case ScriptVerb::kRefine: settings_.refine = s.word == "on"; break;
    case ScriptVerb::kMeasure:
      // Of the settings that the statements before asked for: they are drawn first.
      if (!waiting_ && (!Settled() || !painter_.complete() || !(accepted_ == Drawn() || refused_) || path_recording_)) return false;
      if (!waiting_) StartMeasuring();
      waiting_ = true;
      return !probe_.busy();
    case ScriptVerb::kDifference: settings_.difference = s.word == "on"; break;
    case ScriptVerb::kPhase:
      if (!(facts_.period_s > 0)) throw UsageError("the script's 'phase' says nothing: the scene has no period", "use 'time SECONDS'");
      radiance.time_s = s.numbers[0] * facts_.period_s;
      break;
    case ScriptVerb::kTime: radiance.time_s = s.numbers[0]; break;
    case ScriptVerb::kPlayTime: settings_.play_time = s.word == "on"; break;
    case ScriptVerb::kKeyAdd: AddKey(s.numbers.empty() ? std::nullopt : std::optional(s.numbers[0])); break;
    case ScriptVerb::kKeyUpdate: ReplaceKey(path_, KeyCalled(s.numbers[0]), CurrentKey(0)); break;
    case ScriptVerb::kKeyDelete: DeleteKey(path_, KeyCalled(s.numbers[0])); break;
    case ScriptVerb::kKeyTime: settings_.selected_key = static_cast<int>(RetimeKey(path_, KeyCalled(s.numbers[0]), s.numbers[1])); break;
    case ScriptVerb::kKeyJump: JumpToKey(static_cast<int>(KeyCalled(s.numbers[0]))); break;
    case ScriptVerb::kKeysClear: path_ = {}; break;
    case ScriptVerb::kPathSize:
      path_.width_px = static_cast<int>(s.numbers[0]);
      path_.height_px = static_cast<int>(s.numbers[1]);
      break;
    case ScriptVerb::kPathFps:
      path_.fps = s.numbers[0];
      path_.frames = 0;
      break;
    case ScriptVerb::kPathSeconds: StretchTo(path_, s.numbers[0]); break;
    case ScriptVerb::kPathLoad: LoadPath(s.word); break;
    case ScriptVerb::kPathSave: SavePath(s.word, false); break;
    case ScriptVerb::kPathSaveNerfstudio: SavePath(s.word, true); break;
    case ScriptVerb::kPlay:
      if (!waiting_) StartPlaying();
      waiting_ = true;
      return !playing_s_;
    case ScriptVerb::kRecord:
    case ScriptVerb::kRecordStart:
      // By the settings that the statements before asked for.
      if (!waiting_ && (!Settled() || !painter_.complete() || !(accepted_ == Drawn() || refused_))) return false;
      if (!waiting_) StartRecording(s.word);
      waiting_ = true;
      return s.verb == ScriptVerb::kRecordStart || !path_recording_;
    case ScriptVerb::kRecordLive: StartLiveRecording(s.word); break;
    case ScriptVerb::kRecordStop:
      FinishRecording();
      return !live_recording_ && !path_recording_;
    case ScriptVerb::kRecordCancel:
      CancelRecording();
      return !live_recording_ && !path_recording_;
    case ScriptVerb::kWait:
    case ScriptVerb::kScreenshot: return false;
  }
  PathEdited();
  return true;
}

void Viewer::AfterPainting() {
  if (script_.empty()) return;
  const ScriptStep& s = script_.front();
  if (s.verb == ScriptVerb::kWait) {
    if (!waiting_) waiting_since_ = Clock::now();
    waiting_ = true;
    const double waited = SecondsSince(waiting_since_);
    const bool done = s.numbers.empty()
                          ? Settled() && motion_.ToProbe() == nullptr && painter_.complete() && drawn_generation_ == generation_ &&
                                !RefinementOpen() && !HeatOpen()
                          : waited >= s.numbers[0];
    if (!done && waited < std::max(kScriptPatience_s, s.numbers.empty() ? 0.0 : s.numbers[0])) return;
    if (!done)
      throw MachineError("the script's 'wait' took longer than " + std::to_string(static_cast<int>(kScriptPatience_s)) + " seconds");
  } else if (s.verb == ScriptVerb::kScreenshot) {
    if (!painter_.complete() || (Settled() && (RefinementOpen() || HeatOpen()))) return;
    Screenshot(s.word, settings_.panel);
  } else {
    return;
  }
  waiting_ = false;
  script_.pop_front();
}

}  // namespace lumi
