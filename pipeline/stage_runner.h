// The stages of one run: sibling programs started one after the other, with a record of each whose program keeps none,
// so that a later run starts only those whose inputs changed.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/options.h"
#include "pipeline/sibling_stage.h"
#include "pipeline/work_times.h"
#include "scene/files/provenance.h"
#include "scene/program/progress.h"

namespace lumi {

// A stage whose program writes wherever it is told to, and no record into the scene.
struct RecordedStage {
  std::string name, program;
  std::map<std::string, std::filesystem::path> inputs;  // what is read, by the name that the record gives it
  std::vector<std::filesystem::path> outputs;           // in the scene
  std::vector<std::string> paths;                       // go before the options
  std::vector<std::string> arguments;                   // options: names and values in turn
};

class StageRunner {
 public:
  // count: as announced ("stage 2/5"). `options` and `progress` have to outlive the stages.
  StageRunner(std::filesystem::path scene, const PipelineOptions& options, int count, ProgressSink& progress);

  // All of these throw what the stage's program said where it failed.
  void Start(const std::string& name, const std::string& program, std::vector<std::string> arguments);
  void StartRecorded(const RecordedStage& stage);
  // Until RunWaiting, which runs all that wait at the same time. Their inputs are looked at now.
  void LetWait(const RecordedStage& stage);
  // ended: called for each in turn, and calls `keep`, which throws where the stage failed. All are kept that can be
  // before the first failure is thrown.
  void RunWaiting(const std::function<void(const std::string& name, const std::function<void()>& keep)>& ended);

  // One that was run elsewhere.
  void Add(StageResult stage);
  // One less than announced.
  void LeaveOut() { --count_; }

  std::vector<std::string> WithCommonOptions(std::vector<std::string> arguments) const;
  // Those that have ended.
  const std::vector<StageResult>& results() const { return results_; }
  double colmap_seconds() const { return colmap_seconds_; }

 private:
  struct Recorded {
    std::string name, program;
    std::vector<std::string> arguments;
    Provenance wanted;
    std::filesystem::path record;
    std::vector<std::filesystem::path> outputs;
    std::optional<StageResult> reused = {};  // nothing is to be done
  };

  Recorded Record(const RecordedStage& stage) const;
  StageResult RunOrReuse(const Recorded& stage, std::size_t before, ProgressSink& progress) const;
  void Keep(Recorded& stage, const StageResult& result);
  SiblingStage StageOf(const std::string& name, const std::string& program, std::vector<std::string> arguments,
                       std::size_t before, const std::string& wanted = {}) const;

  std::filesystem::path scene_;
  const PipelineOptions& options_;
  int count_;
  ProgressSink& progress_;
  WorkTimes times_;
  std::vector<StageResult> results_;
  double colmap_seconds_ = 0;
  std::vector<Recorded> waiting_;
};

}  // namespace lumi
