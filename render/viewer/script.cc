#include "render/viewer/script.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string_view>

#include "render/effects/effects.h"
#include "render/path/camera_path.h"
#include "render/radiance/setting_options.h"
#include "render/radiance/settings.h"
#include "render/viewer/seen.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

enum class Takes { kNothing, kNumbers, kNumberOrNothing, kText, kOption, kOnOff };

struct Grammar {
  std::string_view name;
  ScriptVerb verb;
  Takes takes;
  int numbers;  // of kNumbers
  std::string_view usage;
};

constexpr std::array kGrammar{
    Grammar{"jump", ScriptVerb::kJump, Takes::kText, 0, "jump PHOTO (name, or position from 0)"},
    Grammar{"fly-to", ScriptVerb::kFlyTo, Takes::kText, 0, "fly-to PHOTO"},
    Grammar{"home", ScriptVerb::kHome, Takes::kNothing, 0, "home"},
    Grammar{"orbit", ScriptVerb::kOrbit, Takes::kNumbers, 2, "orbit RIGHT_DEG UP_DEG"},
    Grammar{"look", ScriptVerb::kLook, Takes::kNumbers, 2, "look RIGHT_DEG UP_DEG"},
    Grammar{"move", ScriptVerb::kMove, Takes::kNumbers, 3, "move RIGHT UP FORWARD (in scene sizes)"},
    Grammar{"dolly", ScriptVerb::kDolly, Takes::kNumbers, 1, "dolly FACTOR (below 1: nearer)"},
    Grammar{"zoom", ScriptVerb::kZoom, Takes::kNumbers, 1, "zoom FACTOR (below 1: narrower)"},
    Grammar{"k", ScriptVerb::kK, Takes::kText, 0, "k 1..16|all"},
    Grammar{"set", ScriptVerb::kSet, Takes::kOption, 0,
            "set OPTION VALUE (an option of lumi-render's reconstruction, without dashes)"},
    Grammar{"effects", ScriptVerb::kEffects, Takes::kText, 0, "effects auto|none|LIST (as --effects takes it)"},
    Grammar{"show", ScriptVerb::kShow, Takes::kText, 0,
            "show color|false-color|tessellation|proxy|MAP (weights, angle ...: as --show names heat maps)"},
    Grammar{"drop", ScriptVerb::kDrop, Takes::kText, 0,
            "drop SCENE (as if it were dropped on the window: it is opened)"},
    Grammar{"frusta", ScriptVerb::kFrusta, Takes::kOnOff, 0, "frusta on|off"},
    Grammar{"mesh", ScriptVerb::kMesh, Takes::kOnOff, 0, "mesh on|off"},
    Grammar{"fill", ScriptVerb::kFill, Takes::kOnOff, 0, "fill on|off (what no photo sees, from around it)"},
    Grammar{"path", ScriptVerb::kPath, Takes::kOnOff, 0, "path on|off"},
    Grammar{"panel", ScriptVerb::kPanel, Takes::kOnOff, 0, "panel on|off"},
    Grammar{"open", ScriptVerb::kOpen, Takes::kText, 0, "open GROUP (of the panel)"},
    Grammar{"close", ScriptVerb::kClose, Takes::kText, 0, "close GROUP (of the panel)"},
    Grammar{"proxy", ScriptVerb::kProxy, Takes::kText, 0, "proxy NAME"},
    Grammar{"budget", ScriptVerb::kBudget, Takes::kNumbers, 1, "budget MILLISECONDS (0: none)"},
    Grammar{"refine", ScriptVerb::kRefine, Takes::kOnOff, 0, "refine on|off"},
    Grammar{"difference", ScriptVerb::kDifference, Takes::kOnOff, 0,
            "difference on|off (of the error measured last, in the panel's manner)"},
    Grammar{"measure", ScriptVerb::kMeasure, Takes::kNothing, 0, "measure"},
    Grammar{"mark", ScriptVerb::kMark, Takes::kNumbers, 2, "mark X Y (of the window, 0 to 1 from the top left)"},
    Grammar{"distance", ScriptVerb::kDistance, Takes::kNumbers, 1, "distance METRES (between the two marks)"},
    Grammar{"time", ScriptVerb::kTime, Takes::kNumbers, 1, "time SECONDS"},
    Grammar{"phase", ScriptVerb::kPhase, Takes::kNumbers, 1, "phase PHASE (of the scene's period, 0 to 1)"},
    Grammar{"play-time", ScriptVerb::kPlayTime, Takes::kOnOff, 0, "play-time on|off"},
    Grammar{"key-add", ScriptVerb::kKeyAdd, Takes::kNumberOrNothing, 0, "key-add [SECONDS]"},
    Grammar{"key-update", ScriptVerb::kKeyUpdate, Takes::kNumbers, 1, "key-update INDEX"},
    Grammar{"key-delete", ScriptVerb::kKeyDelete, Takes::kNumbers, 1, "key-delete INDEX"},
    Grammar{"key-time", ScriptVerb::kKeyTime, Takes::kNumbers, 2, "key-time INDEX SECONDS"},
    Grammar{"key-jump", ScriptVerb::kKeyJump, Takes::kNumbers, 1, "key-jump INDEX"},
    Grammar{"keys-clear", ScriptVerb::kKeysClear, Takes::kNothing, 0, "keys-clear"},
    Grammar{"path-size", ScriptVerb::kPathSize, Takes::kNumbers, 2, "path-size WIDTH HEIGHT (pixels, 16 to 8192)"},
    Grammar{"path-fps", ScriptVerb::kPathFps, Takes::kNumbers, 1, "path-fps FRAMES_A_SECOND (1 to 240)"},
    Grammar{"path-seconds", ScriptVerb::kPathSeconds, Takes::kNumbers, 1, "path-seconds SECONDS"},
    Grammar{"path-load", ScriptVerb::kPathLoad, Takes::kText, 0, "path-load FILE"},
    Grammar{"path-save", ScriptVerb::kPathSave, Takes::kText, 0, "path-save FILE"},
    Grammar{"path-save-nerfstudio", ScriptVerb::kPathSaveNerfstudio, Takes::kText, 0, "path-save-nerfstudio FILE"},
    Grammar{"play", ScriptVerb::kPlay, Takes::kNothing, 0, "play"},
    Grammar{"record", ScriptVerb::kRecord, Takes::kText, 0, "record FILE.mp4"},
    Grammar{"record-start", ScriptVerb::kRecordStart, Takes::kText, 0, "record-start FILE.mp4"},
    Grammar{"record-live", ScriptVerb::kRecordLive, Takes::kText, 0, "record-live FILE.mp4"},
    Grammar{"record-stop", ScriptVerb::kRecordStop, Takes::kNothing, 0, "record-stop"},
    Grammar{"record-cancel", ScriptVerb::kRecordCancel, Takes::kNothing, 0, "record-cancel"},
    Grammar{"export-page", ScriptVerb::kExportPage, Takes::kText, 0, "export-page FILE.html"},
    Grammar{"wait", ScriptVerb::kWait, Takes::kNumberOrNothing, 0, "wait [SECONDS]"},
    Grammar{"screenshot", ScriptVerb::kScreenshot, Takes::kText, 0, "screenshot FILE"},
};

double Number(const std::string& word, const std::string& statement) {
  char* end = nullptr;
  const double value = std::strtod(word.c_str(), &end);
  if (end == word.c_str() || *end != 0 || !std::isfinite(value))
    throw UsageError(fmt::format("'{}' is not a number in the script's '{}'", word, statement));
  return value;
}

bool OneOf(const std::string& word, std::initializer_list<const char*> allowed) {
  for (const char* a : allowed)
    if (word == a) return true;
  return false;
}

std::string Trimmed(const std::string& s) {
  const auto first = s.find_first_not_of(" \t\r"), last = s.find_last_not_of(" \t\r");
  return first == std::string::npos ? "" : s.substr(first, last - first + 1);
}

ScriptStep ParseStatement(const std::string& statement) {
  std::istringstream in(statement);
  std::string name;
  in >> name;
  for (const Grammar& g : kGrammar) {
    if (g.name != name) continue;
    ScriptStep step;
    step.verb = g.verb;
    step.text = statement;
    const bool numbers = g.takes == Takes::kNumbers || g.takes == Takes::kNumberOrNothing;
    if (g.takes == Takes::kOption) in >> step.word;
    std::string rest;
    if (!numbers) std::getline(in, rest);
    (g.takes == Takes::kOption ? step.value : step.word) = Trimmed(rest);
    if (numbers)
      for (std::string word; in >> word;) step.numbers.push_back(Number(word, statement));
    const auto count = static_cast<int>(step.numbers.size());
    bool fits = true;
    switch (g.takes) {
      case Takes::kNothing: fits = step.word.empty(); break;
      case Takes::kNumbers: fits = count == g.numbers; break;
      case Takes::kNumberOrNothing: fits = count <= 1; break;
      case Takes::kText: fits = !step.word.empty(); break;
      case Takes::kOption: fits = !step.word.empty() && !step.value.empty(); break;
      case Takes::kOnOff: fits = OneOf(step.word, {"on", "off"}); break;
    }
    fits = fits && InRange(step);
    fits = fits && !(step.verb == ScriptVerb::kShow && !SeenFromName(step.word));
    if (fits && step.verb == ScriptVerb::kK && step.word != "all") {
      const double k = Number(step.word, statement);
      fits = k >= 1 && k <= kMaxBlend && k == std::floor(k);
    }
    if (fits && step.verb == ScriptVerb::kSet) {
      RadianceSettings trial;
      std::string problem = "there is no such option";
      try {
        if (SetOption(trial, step.word, step.value)) problem.clear();
      } catch (const UsageError& e) {
        problem = e.what();
      }
      if (!problem.empty())
        throw UsageError(fmt::format("the script's '{}' does not fit: {}", statement, problem),
                         fmt::format("write: {}", g.usage));
    }
    if (fits && step.verb == ScriptVerb::kEffects && !OneOf(step.word, {"auto", "none"})) {
      std::istringstream list(step.word);
      for (std::string effect; std::getline(list, effect, ',');)
        fits = fits && std::find(EffectNames().begin(), EffectNames().end(), effect) != EffectNames().end();
    }
    if (!fits)
      throw UsageError(fmt::format("the script's '{}' does not fit", statement), fmt::format("write: {}", g.usage));
    return step;
  }
  std::string known;
  for (const Grammar& g : kGrammar) known += (known.empty() ? "" : ", ") + std::string(g.name);
  throw UsageError(fmt::format("the script's '{}' is no command", statement), "there are: " + known);
}

}  // namespace

bool InRange(const ScriptStep& step) {
  const std::vector<double>& n = step.numbers;
  const auto whole = [](double v, double low, double high) { return v == std::floor(v) && v >= low && v <= high; };
  constexpr double kMostKeys = 1e6;
  switch (step.verb) {
    case ScriptVerb::kDolly:
    case ScriptVerb::kZoom:
    case ScriptVerb::kDistance: return n[0] > 0;
    case ScriptVerb::kMark: return n[0] >= 0 && n[0] <= 1 && n[1] >= 0 && n[1] <= 1;
    case ScriptVerb::kWait:
    case ScriptVerb::kKeyAdd: return n.empty() || n[0] >= 0;
    case ScriptVerb::kKeyUpdate:
    case ScriptVerb::kKeyDelete:
    case ScriptVerb::kKeyJump: return whole(n[0], 0, kMostKeys);
    case ScriptVerb::kKeyTime: return whole(n[0], 0, kMostKeys) && n[1] >= 0 && n[1] <= kMaxPathSeconds;
    case ScriptVerb::kPathSize: return whole(n[0], 16, 8192) && whole(n[1], 16, 8192);
    case ScriptVerb::kPathFps: return n[0] >= 1 && n[0] <= 240;
    case ScriptVerb::kPathSeconds: return n[0] > 0 && n[0] <= kMaxPathSeconds;
    case ScriptVerb::kBudget: return n[0] == 0 || n[0] >= 1;
    default: return true;
  }
}

std::vector<ScriptStep> ParseScript(const std::string& text) {
  std::vector<ScriptStep> steps;
  std::string statement;
  const auto end = [&] {
    if (const std::string s = Trimmed(statement); !s.empty()) steps.push_back(ParseStatement(s));
    statement.clear();
  };
  for (const char c : text) {
    if (c == ';' || c == '\n')
      end();
    else
      statement += c;
  }
  end();
  return steps;
}

}  // namespace lumi
