#include "pipeline/depth_maps_in_parts.h"

#include <fmt/format.h>

#include "pipeline/sibling_summaries.h"
#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"
#include "scene/program/stopwatch.h"
#include "scene/program/version.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr const char* kDepthMapsStage = "depth-maps";
constexpr int kMostRunsOfParts = 6;  // four are enough where nothing goes wrong

// A part's command as a stage for the executor.
ExecutedStage PartOf(const DepthMapParts& wanted, int i) {
  std::vector<std::string> arguments = wanted.proxy;
  const std::string part = fmt::format("{}/{}", i, wanted.parts);
  arguments.insert(arguments.end(), {"--shard", part});
  arguments.insert(arguments.end(), wanted.common.begin(), wanted.common.end());
  const std::string speaker = fmt::format("{} {}", kDepthMapsStage, part);
  return {fmt::format("{}-{}", kDepthMapsStage, i),
          {"lumi-proxy", std::move(arguments), speaker + " ", speaker + ": "}};
}

}  // namespace

StageResult MakeDepthMapsInParts(const DepthMapParts& wanted, Executor& executor, ProgressSink& progress) {
  const Stopwatch watch;
  const auto result = [&](bool reused) {
    return StageResult{kDepthMapsStage, watch.Seconds(), reused, {}, watch.Seconds()};
  };
  Provenance record;
  record.stage = "depth-map-parts";
  record.version = kVersion;
  record.options["command"] = CommandOf("lumi-proxy", wanted.proxy);
  for (std::size_t i = 0; i + 1 < wanted.common.size(); ++i)
    if (wanted.common[i] == "--seed") record.options["seed"] = wanted.common[i + 1];
  for (const char* input : {"sparse", "images", "masks", "silhouettes"})
    record.inputs[input] = Fingerprint(wanted.scene / input);
  if (IsUpToDate(wanted.scene, record)) return result(true);

  bool finished = false;
  for (int run = 1; run <= kMostRunsOfParts && !finished; ++run) {
    std::vector<ExecutedStage> parts;
    for (int i = 0; i < wanted.parts; ++i) parts.push_back(PartOf(wanted, i));
    finished = true;
    for (const SiblingAnswer& answer :
         executor.RunAll(parts, fmt::format("{}, run {}", kDepthMapsStage, run), progress)) {
      const auto part = answer.summary.As<sibling::PartSummary>();
      finished &= part.finished;
      if (part.folder.empty()) continue;  // none are called for
      const fs::path made_from = part.folder / "made-from.txt";
      record.outputs[made_from.lexically_relative(wanted.scene).generic_string()] = Fingerprint(made_from);
    }
  }
  if (finished) {
    record.seconds = watch.Seconds();
    const FolderLock lock(wanted.scene);
    WriteProvenance(wanted.scene, record);
  } else {
    progress.Message(
        fmt::format("{}: some wait for maps that are not there, and are made with the proxy", kDepthMapsStage));
  }
  return result(false);
}

}  // namespace lumi
