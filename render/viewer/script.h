// The viewer's mini-language (docs/viewer.md): statements apart by ';' or line ends, words by blanks.
#pragma once

#include <string>
#include <vector>

namespace lumi {

enum class ScriptVerb {
  kJump,        // photo: at once
  kFlyTo,       // photo: smoothly, waits until there
  kHome,
  kOrbit,       // degrees right, degrees up
  kLook,        // degrees right, degrees up
  kMove,        // right, up, forward, in units of the scene's size
  kDolly,       // factor
  kZoom,        // factor
  kK,           // 1 to 16, or all
  kShow,        // color, false-color
  kFrusta,      // on, off
  kMesh,        // on, off
  kProxy,       // name
  kWait,        // until photos are loaded and the picture is at full resolution; or seconds
  kScreenshot,  // file
};

struct ScriptStep {
  ScriptVerb verb = ScriptVerb::kWait;
  std::vector<double> numbers;
  std::string word;
  std::string text;  // the statement, for messages
};

// Throws UsageError naming the statement.
std::vector<ScriptStep> ParseScript(const std::string& text);

}  // namespace lumi
