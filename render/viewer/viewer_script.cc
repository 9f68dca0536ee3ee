// How a script steers the viewer.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "render/path/path_editing.h"
#include "render/radiance/setting_options.h"
#include "render/viewer/setting_rules.h"
#include "render/viewer/viewer_app.h"
#include "scene/geometry/angle.h"
#include "scene/program/error.h"

namespace lumi {

void Viewer::RunPathStatement(const ScriptStep& s) {
  switch (s.verb) {
    case ScriptVerb::kKeyAdd: AddKey(s.numbers.empty() ? std::nullopt : std::optional(s.numbers[0])); break;
    case ScriptVerb::kKeyUpdate: ReplaceKey(path_, KeyCalled(s.numbers[0]), CurrentKey(0)); break;
    case ScriptVerb::kKeyDelete: DeleteKey(path_, KeyCalled(s.numbers[0])); break;
    case ScriptVerb::kKeyTime:
      settings_.selected_key = static_cast<int>(RetimeKey(path_, KeyCalled(s.numbers[0]), s.numbers[1]));
      break;
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
    default: break;
  }
}

bool Viewer::RunStatement(const ScriptStep& s) {
  const auto rad = [&](std::size_t i) { return s.numbers[i] * kRadPerDeg; };
  RadianceSettings& radiance = settings_.radiance;
  switch (s.verb) {
    case ScriptVerb::kJump: Jump(FindView(scene_, s.word), true); break;
    case ScriptVerb::kFlyTo:
      if (!script_.waiting) Jump(FindView(scene_, s.word), false);
      script_.waiting = true;
      return !steering_.navigator.flying();
    case ScriptVerb::kHome: steering_.navigator.Set(steering_.home); break;
    case ScriptVerb::kOrbit:
      // The point in the middle is unknown until a picture is drawn.
      if (painter_.empty()) return false;
      steering_.navigator.Orbit(Pivot(), rad(0), rad(1));
      steering_.navigator.LevelAtOnce();
      break;
    case ScriptVerb::kLook:
      steering_.navigator.Look(rad(0), rad(1));
      steering_.navigator.LevelAtOnce();
      break;
    case ScriptVerb::kMove: {
      const double size = 1.0 / scene_.normalized_from_world.scale;
      steering_.navigator.Fly(size * s.numbers[0], size * s.numbers[1], size * s.numbers[2]);
      break;
    }
    case ScriptVerb::kDolly:
      if (painter_.empty()) return false;
      steering_.navigator.Dolly(Pivot(), s.numbers[0]);
      break;
    case ScriptVerb::kZoom: steering_.navigator.Zoom(s.numbers[0]); break;
    case ScriptVerb::kK: radiance.k = s.word == "all" ? 0 : std::stoi(s.word); break;
    case ScriptVerb::kSet:
      SetOption(radiance, s.word, s.value);
      decided_.Add(s.word);
      Reconcile(radiance, s.word);
      break;
    case ScriptVerb::kEffects:
      if (!Settled()) return false;  // effects "auto" needs the photos' estimates
      SetEffects(s.word, effects_, radiance);
      break;
    case ScriptVerb::kShow: settings_.seen = *SeenFromName(s.word); break;
    case ScriptVerb::kFrusta: settings_.frusta = s.word == "on"; break;
    case ScriptVerb::kMesh: settings_.mesh = s.word == "on"; break;
    case ScriptVerb::kFill: settings_.fill = s.word == "on"; break;
    case ScriptVerb::kPath: settings_.path = s.word == "on"; break;
    case ScriptVerb::kPanel: settings_.panel = s.word == "on"; break;
    case ScriptVerb::kOpen:
    case ScriptVerb::kClose: {
      const auto& names = PanelGroups();
      if (std::find(names.begin(), names.end(), s.word) == names.end())
        throw UsageError(fmt::format("the panel has no group '{}'", s.word),
                         fmt::format("there are: {}", fmt::join(names, ", ")));
      settings_.groups[s.word] = s.verb == ScriptVerb::kOpen;
      break;
    }
    case ScriptVerb::kProxy:
      if (!script_.waiting) WishProxy(s.word);
      script_.waiting = true;
      return !arriving_.proxy.valid();
    case ScriptVerb::kBudget: settings_.budget_ms = s.numbers[0]; break;
    case ScriptVerb::kRefine: settings_.refine = s.word == "on"; break;
    case ScriptVerb::kMeasure:
      // Waits until the settings of earlier statements are drawn.
      if (!script_.waiting && (!Settled() || !painter_.complete() || !(drawn_.settings == Drawn() || drawn_.refused) ||
                               jobs_.path_recording))
        return false;
      if (!script_.waiting) StartMeasuring();
      script_.waiting = true;
      return !jobs_.probe.busy();
    case ScriptVerb::kMark:
      if (!painter_.complete()) return false;  // the depth is read from the complete picture
      Mark(Eigen::Vector2d(s.numbers[0], s.numbers[1]).cwiseProduct(size_px_.cast<double>()));
      break;
    case ScriptVerb::kDistance: SetScale(s.numbers[0]); break;
    case ScriptVerb::kDifference: settings_.difference = s.word == "on"; break;
    case ScriptVerb::kPhase:
      if (!(facts_.period_s > 0))
        throw UsageError("the script's 'phase' says nothing: the scene has no period", "use 'time SECONDS'");
      radiance.time_s = s.numbers[0] * facts_.period_s;
      break;
    case ScriptVerb::kTime: radiance.time_s = s.numbers[0]; break;
    case ScriptVerb::kPlayTime: settings_.play_time = s.word == "on"; break;
    case ScriptVerb::kPlay:
      if (!script_.waiting) StartPlaying();
      script_.waiting = true;
      return !playing_s_;
    case ScriptVerb::kExportPage:
      if (!script_.waiting) StartExport(s.word);
      script_.waiting = true;
      return jobs_.page_export == nullptr;
    case ScriptVerb::kRecord:
    case ScriptVerb::kRecordStart:
    case ScriptVerb::kRecordLive:
    case ScriptVerb::kRecordStop:
    case ScriptVerb::kRecordCancel: return RunRecordingStatement(s);
    default: RunPathStatement(s); break;
  }
  PathEdited();
  return true;
}

}  // namespace lumi
