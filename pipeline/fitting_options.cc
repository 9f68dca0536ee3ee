#include "pipeline/fitting_options.h"

#include <fmt/format.h>

#include <filesystem>
#include <vector>

#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;

void RequireOptionsForKind(const PipelineOptions& options, InputKind kind) {
  if (kind != InputKind::kCapture && (!options.reconstruct_arguments.empty() || !options.calibration.empty()))
    throw UsageError(fmt::format("{} is for photos or a video, and {} has its cameras already",
                                 options.calibration.empty() ? options.reconstruct_arguments.front() : "--calibration",
                                 options.input.string()),
                     "give its folder of photos, with --poses none, to find the cameras anew");
  std::error_code error;
  if (options.inputs.size() > 1 && kind != InputKind::kCapture)
    throw UsageError(fmt::format("{} is no video: several inputs are videos of one place", options.input.string()),
                     "give one scene or workspace");
  if (options.periodic && (kind != InputKind::kCapture || fs::is_directory(options.input, error)))
    throw UsageError(fmt::format("--periodic is for one video, and {} is none", options.input.string()),
                     "give the video file");
  if (!options.fixed_video.empty() && !fs::exists(options.fixed_video, error))
    throw InputError(options.fixed_video, "no such file", "what --fixed-video names");
  if (!options.calibration.empty() && !fs::exists(options.calibration, error))
    throw InputError(options.calibration, "no such file or folder", "what --calibration names");
}

void RequireSeparatePaths(const PipelineOptions& options, InputKind kind) {
  if (kind == InputKind::kOurScene) return;
  for (const fs::path& input : options.inputs.size() > 1 ? options.inputs : std::vector{options.input})
    if (IsWithin(input, options.output))
      throw UsageError(fmt::format("{} lies inside the output {}", input.string(), options.output.string()),
                       "choose an output that does not contain the input");
  std::error_code error;
  if (fs::is_directory(options.input, error) && IsWithin(options.output, options.input))
    throw UsageError(
        fmt::format("the output {} lies inside the input {}", options.output.string(), options.input.string()),
        "choose an output beside it");
}

}  // namespace lumi
