// The viewer's mini-language (docs/viewer.md): statements apart by ';' or line ends, words by blanks.
#pragma once

#include <string>
#include <vector>

namespace lumi {

// What each takes: the grammar in script.cc.
enum class ScriptVerb {
  kJump,
  kFlyTo,
  kHome,
  kOrbit,
  kLook,
  kMove,
  kDolly,
  kZoom,
  kK,
  kSet,
  kEffects,
  kShow,
  kFrusta,
  kMesh,
  kFill,
  kPath,
  kPanel,
  kOpen,
  kClose,
  kProxy,
  kBudget,
  kRefine,
  kDifference,
  kPhase,
  kMeasure,
  kMark,
  kDistance,
  kTime,
  kPlayTime,
  kKeyAdd,
  kKeyUpdate,
  kKeyDelete,
  kKeyTime,
  kKeyJump,
  kKeysClear,
  kPathSize,
  kPathFps,
  kPathSeconds,
  kPathLoad,
  kPathSave,
  kPathSaveNerfstudio,
  kPlay,
  kRecord,
  kRecordStart,
  kRecordLive,
  kRecordStop,
  kRecordCancel,
  kExportPage,
  kDrop,
  kWait,
  kScreenshot,
};

struct ScriptStep {
  ScriptVerb verb = ScriptVerb::kWait;
  std::vector<double> numbers;
  std::string word, value;  // value: of kSet
  std::string text;         // the statement, for messages
};

// Whether its numbers may be.
bool InRange(const ScriptStep& step);

// Throws UsageError naming the statement.
std::vector<ScriptStep> ParseScript(const std::string& text);

}  // namespace lumi
