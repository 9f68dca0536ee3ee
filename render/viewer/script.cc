#include "render/viewer/script.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string_view>

#include "render/radiance/settings.h"
#include "scene/program/error.h"

namespace lumi {
namespace {

struct Grammar {
  std::string_view name;
  ScriptVerb verb;
  int numbers;            // how many
  bool word;              // one word or the rest of the statement
  std::string_view usage;
};

constexpr std::array kGrammar{
    Grammar{"jump", ScriptVerb::kJump, 0, true, "jump PHOTO (name, or position from 0)"},
    Grammar{"fly-to", ScriptVerb::kFlyTo, 0, true, "fly-to PHOTO"},
    Grammar{"home", ScriptVerb::kHome, 0, false, "home"},
    Grammar{"orbit", ScriptVerb::kOrbit, 2, false, "orbit RIGHT_DEG UP_DEG"},
    Grammar{"look", ScriptVerb::kLook, 2, false, "look RIGHT_DEG UP_DEG"},
    Grammar{"move", ScriptVerb::kMove, 3, false, "move RIGHT UP FORWARD (in scene sizes)"},
    Grammar{"dolly", ScriptVerb::kDolly, 1, false, "dolly FACTOR (below 1: nearer)"},
    Grammar{"zoom", ScriptVerb::kZoom, 1, false, "zoom FACTOR (below 1: narrower)"},
    Grammar{"k", ScriptVerb::kK, 0, true, "k 1..16|all"},
    Grammar{"show", ScriptVerb::kShow, 0, true, "show color|false-color"},
    Grammar{"frusta", ScriptVerb::kFrusta, 0, true, "frusta on|off"},
    Grammar{"mesh", ScriptVerb::kMesh, 0, true, "mesh on|off"},
    Grammar{"proxy", ScriptVerb::kProxy, 0, true, "proxy NAME"},
    Grammar{"wait", ScriptVerb::kWait, -1, false, "wait [SECONDS]"},
    Grammar{"screenshot", ScriptVerb::kScreenshot, 0, true, "screenshot FILE"},
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
    if (g.word) {
      std::getline(in, step.word);
      step.word = Trimmed(step.word);
    } else {
      for (std::string word; in >> word;) step.numbers.push_back(Number(word, statement));
    }
    const auto count = static_cast<int>(step.numbers.size());
    const bool positive = step.verb == ScriptVerb::kDolly || step.verb == ScriptVerb::kZoom;
    const bool on_off = step.verb == ScriptVerb::kFrusta || step.verb == ScriptVerb::kMesh;
    bool fits = g.word ? !step.word.empty() : g.numbers >= 0 ? count == g.numbers : count <= 1 && (count == 0 || step.numbers[0] >= 0);
    fits = fits && !(positive && !(step.numbers[0] > 0));
    fits = fits && !(on_off && !OneOf(step.word, {"on", "off"}));
    fits = fits && !(step.verb == ScriptVerb::kShow && !OneOf(step.word, {"color", "false-color"}));
    if (fits && step.verb == ScriptVerb::kK && step.word != "all") {
      const double k = Number(step.word, statement);
      fits = k >= 1 && k <= kMaxBlend && k == std::floor(k);
    }
    if (!fits) throw UsageError(fmt::format("the script's '{}' does not fit", statement), fmt::format("write: {}", g.usage));
    return step;
  }
  std::string known;
  for (const Grammar& g : kGrammar) known += (known.empty() ? "" : ", ") + std::string(g.name);
  throw UsageError(fmt::format("the script's '{}' is no command", statement), "there are: " + known);
}

}  // namespace

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
