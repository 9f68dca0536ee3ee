#include "pipeline/stage_runner.h"

#include <exception>
#include <future>
#include <mutex>
#include <utility>

#include "pipeline/named_remarks.h"
#include "pipeline/sibling_summaries.h"
#include "scene/files/atomic_file.h"
#include "scene/program/stopwatch.h"
#include "scene/program/subprocess.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;

StageRunner::StageRunner(fs::path scene, const PipelineOptions& options, int count, ProgressSink& progress)
    : scene_(std::move(scene)), options_(options), count_(count), progress_(progress), times_(scene_) {}

void StageRunner::Start(const std::string& name, const std::string& program, std::vector<std::string> arguments) {
  Add(RunSiblingStage(StageOf(name, program, std::move(arguments), results_.size()), progress_));
}

void StageRunner::StartRecorded(const RecordedStage& stage) {
  Recorded recorded = Record(stage);
  Keep(recorded, RunOrReuse(recorded, results_.size(), progress_));
}

void StageRunner::LetWait(const RecordedStage& stage) { waiting_.push_back(Record(stage)); }

void StageRunner::RunWaiting(
    const std::function<void(const std::string& name, const std::function<void()>& keep)>& ended) {
  std::mutex mutex;
  NamedRemarks remarks(progress_, mutex, {});
  std::vector<std::future<StageResult>> running;
  for (std::size_t i = 0; i < waiting_.size(); ++i)
    running.push_back(
        std::async(std::launch::async, [&, i] { return RunOrReuse(waiting_[i], results_.size() + i, remarks); }));
  for (const auto& r : running) r.wait();
  std::exception_ptr failure;
  for (std::size_t i = 0; i < running.size(); ++i) {
    try {
      ended(waiting_[i].name, [&] { Keep(waiting_[i], running[i].get()); });
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  }
  waiting_.clear();
  if (failure) std::rethrow_exception(failure);
}

void StageRunner::Add(StageResult stage) {
  if (!stage.reused)
    times_.Keep(stage.name, {stage.seconds, stage.summary.As<sibling::CamerasSummary>().colmap_seconds});
  const WorkTime time = times_.Of(stage.name, {stage.seconds, 0});
  stage.computed_seconds = time.seconds;
  colmap_seconds_ += time.colmap_seconds;
  results_.push_back(std::move(stage));
}

std::vector<std::string> StageRunner::WithCommonOptions(std::vector<std::string> arguments) const {
  arguments.insert(arguments.end(),
                   {"--threads", std::to_string(options_.threads), "--seed", std::to_string(options_.seed)});
  return arguments;
}

// What the stage follows from, and its answer of an earlier run where nothing of that changed.
StageRunner::Recorded StageRunner::Record(const RecordedStage& stage) const {
  Provenance wanted;
  wanted.stage = stage.name;
  wanted.version = kVersion;
  for (std::size_t i = 0; i + 1 < stage.arguments.size(); i += 2)
    wanted.options[stage.arguments[i].substr(2)] = stage.arguments[i + 1];
  for (const auto& [part, path] : stage.inputs) wanted.inputs[part] = Fingerprint(path);
  wanted.inputs[stage.program] = Fingerprint(SiblingProgram(stage.program));

  std::vector<std::string> arguments = stage.paths;
  arguments.insert(arguments.end(), stage.arguments.begin(), stage.arguments.end());
  Recorded recorded{stage.name,
                    stage.program,
                    std::move(arguments),
                    std::move(wanted),
                    scene_ / "provenance" / (stage.name + ".summary"),
                    stage.outputs};
  const Stopwatch stopwatch;
  if (IsUpToDate(scene_, recorded.wanted)) {
    const double seconds = stopwatch.Seconds();
    recorded.reused = {stage.name, seconds,
                       true,       JsonKeys::Parse(ReadText(recorded.record)).value_or(JsonKeys()),
                       seconds,    CommandOf(stage.program, WithCommonOptions(recorded.arguments))};
  }
  return recorded;
}

// before: stages before this one.
StageResult StageRunner::RunOrReuse(const Recorded& stage, std::size_t before, ProgressSink& progress) const {
  if (stage.reused) return *stage.reused;
  return RunSiblingStage(StageOf(stage.name, stage.program, stage.arguments, before, JsonKeys(stage.wanted).Text()),
                         progress);
}

void StageRunner::Keep(Recorded& stage, const StageResult& result) {
  Add(result);
  if (stage.reused) return;
  stage.wanted.seconds = result.seconds;
  const FolderLock lock(scene_);
  WriteTextAtomically(stage.record, result.summary.Text());
  stage.wanted.outputs[stage.record.lexically_relative(scene_).generic_string()] = Fingerprint(stage.record);
  for (const fs::path& file : stage.outputs)
    stage.wanted.outputs[file.lexically_relative(scene_).generic_string()] = Fingerprint(file);
  WriteProvenance(scene_, stage.wanted);
}

// wanted: as ExecutedStage has it.
SiblingStage StageRunner::StageOf(const std::string& name, const std::string& program,
                                  std::vector<std::string> arguments, std::size_t before,
                                  const std::string& wanted) const {
  return {name,
          program,
          WithCommonOptions(std::move(arguments)),
          static_cast<int>(before) + 1,
          count_,
          options_.executor.get(),
          wanted};
}

}  // namespace lumi
