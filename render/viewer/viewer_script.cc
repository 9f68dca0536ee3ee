// How a script steers the viewer.
#include <string>

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
    const ScriptStep& s = script_.front();
    const auto rad = [&](std::size_t i) { return s.numbers[i] * kRadPerDeg; };
    switch (s.verb) {
      case ScriptVerb::kJump: Jump(FindView(scene_, s.word), true); break;
      case ScriptVerb::kFlyTo:
        if (!waiting_) {
          Jump(FindView(scene_, s.word), false);
          waiting_ = true;
        }
        if (navigator_.flying()) return;
        waiting_ = false;
        break;
      case ScriptVerb::kHome: navigator_.Set(home_); break;
      case ScriptVerb::kOrbit:
        // The point in the middle of a picture that is not drawn yet is not known.
        if (painter_.empty()) return;
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
        if (painter_.empty()) return;
        navigator_.Dolly(Pivot(), s.numbers[0]);
        break;
      case ScriptVerb::kZoom: navigator_.Zoom(s.numbers[0]); break;
      case ScriptVerb::kK: settings_.radiance.k = s.word == "all" ? 0 : std::stoi(s.word); break;
      case ScriptVerb::kShow: settings_.show = s.word == "color" ? Show::kColor : Show::kFalseColor; break;
      case ScriptVerb::kFrusta: settings_.frusta = s.word == "on"; break;
      case ScriptVerb::kMesh: settings_.mesh = s.word == "on"; break;
      case ScriptVerb::kProxy:
        if (!waiting_) WishProxy(s.word);
        waiting_ = proxy_loading_.valid();
        if (waiting_) return;
        break;
      case ScriptVerb::kWait:
      case ScriptVerb::kScreenshot: return;
    }
    script_.pop_front();
  }
}

void Viewer::AfterPainting() {
  if (script_.empty()) return;
  const ScriptStep& s = script_.front();
  if (s.verb == ScriptVerb::kWait) {
    if (!waiting_) waiting_since_ = Clock::now();
    waiting_ = true;
    const double waited = SecondsSince(waiting_since_);
    const bool done = s.numbers.empty() ? !Loading() && painter_.complete() && drawn_generation_ == generation_ : waited >= s.numbers[0];
    if (!done && waited < std::max(kScriptPatience_s, s.numbers.empty() ? 0.0 : s.numbers[0])) return;
    if (!done) throw MachineError("the script's 'wait' took longer than " + std::to_string(static_cast<int>(kScriptPatience_s)) + " seconds");
  } else if (s.verb == ScriptVerb::kScreenshot) {
    if (!painter_.complete()) return;
    Screenshot(s.word, settings_.panel);
  } else {
    return;
  }
  waiting_ = false;
  script_.pop_front();
}

}  // namespace lumi
