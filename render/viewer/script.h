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
  kSet,         // an option of the reconstruction (word) and its value
  kEffects,     // auto, none, or a list
  kShow,        // color, false-color, tessellation
  kFrusta,      // on, off
  kMesh,        // on, off
  kPath,        // on, off: the camera path in the picture
  kPanel,       // on, off
  kOpen,        // a group of the panel
  kClose,       // a group of the panel
  kProxy,       // name
  kBudget,      // milliseconds, 0: none
  kRefine,      // on, off
  kDifference,  // shown or not: of the error measured last
  kPhase,       // of the scene's period
  kMeasure,     // the error at the nearest photo; waits for it
  kTime,        // seconds
  kPlayTime,    // on, off
  kKeyAdd,      // here, after the last key; or at a time
  kKeyUpdate,   // index: this camera
  kKeyDelete,   // index
  kKeyTime,     // index, seconds
  kKeyJump,     // index
  kKeysClear,
  kPathSize,    // width, height
  kPathFps,     // frames a second
  kPathSeconds, // duration
  kPathLoad,    // file
  kPathSave,    // file, our format
  kPathSaveNerfstudio,  // file
  kPlay,        // the path, once; waits until its end
  kRecord,      // file: the path; waits until it is written
  kRecordStart, // file: the path; does not wait
  kRecordLive,  // file: what is seen, until record-stop
  kRecordStop,  // waits until it is written
  kRecordCancel,
  kWait,        // until photos are loaded and the picture is at full resolution; or seconds
  kScreenshot,  // file
};

struct ScriptStep {
  ScriptVerb verb = ScriptVerb::kWait;
  std::vector<double> numbers;
  std::string word, value;   // value: of kSet
  std::string text;  // the statement, for messages
};

// Throws UsageError naming the statement.
std::vector<ScriptStep> ParseScript(const std::string& text);

}  // namespace lumi
