#include "pipeline/options.h"

#include <fmt/format.h>

#include <algorithm>

namespace lumi {

bool HasSilhouetteSource(const PipelineOptions& o) {
  return !o.silhouette_rule.empty() || !o.silhouettes.empty() || !o.silhouette_background.empty();
}

bool IsCameraFile(const std::filesystem::path& path) {
  return path.extension() == ".yaml" || path.extension() == ".yml";
}

std::string Validate(const PipelineOptions& options) {
  if (options.input.empty()) return "INPUT is missing";
  if (options.holdout != 0 && options.holdout < 2) return "--holdout is 0 (no evaluation) or at least 2";
  if (options.video_width_px < 16 || options.video_width_px > 16384) return "--width is 16 to 16384 pixels";
  if (!(options.video_seconds >= 0.1 && options.video_seconds <= 3600)) return "--seconds is 0.1 to 3600";
  if (!(options.video_fidelity_db >= 0 && options.video_fidelity_db <= 99))
    return "--fidelity-db is 0 (a weight at every pixel) to 99 dB";
  const bool boards = !options.calibration.empty() && !IsCameraFile(options.calibration);
  if (!boards && (!options.board.empty() || !options.square_mm.empty()))
    return "--board and --square-mm go with --calibration BOARDS";
  if (!options.silhouette_rule.empty() + !options.silhouettes.empty() + !options.silhouette_background.empty() > 1)
    return "give one of --silhouette-rule, --silhouettes and --silhouette-background";
  if (!options.periodic && (!options.fixed_video.empty() || !options.period_frames.empty()))
    return "--fixed-video and --period-frames go with --periodic";
  if (!options.fixed_video.empty() && !options.period_frames.empty())
    return "give one of --fixed-video and --period-frames";
  if (options.proxy_minutes && !(*options.proxy_minutes >= 0)) return "--proxy-minutes is at least 0";
  if (options.minutes && !(*options.minutes > 0 && *options.minutes <= 1e5))
    return "--minutes is above 0, and at most 100000";
  if (options.minutes && options.proxy_minutes) return "give one of --minutes and --proxy-minutes";
  if (options.depth_width_px && (options.minutes || options.proxy_minutes))
    return "give one of --depth-width, --minutes and --proxy-minutes";
  if (options.depth_width_px && options.proxy != "auto") return "--depth-width goes with --proxy auto";
  if (options.budget_ms && !(*options.budget_ms > 0)) return "--budget-ms must be above 0";
  if (options.budget_ms && options.proxy != "auto") return "--budget-ms goes with --proxy auto";
  if (options.parts < 1 || options.parts > 1000) return "--parts is 1 to 1000";
  if (options.parts > 1 && options.proxy_minutes.value_or(0) > 0)
    return "--parts takes --depth-width, not --proxy-minutes: how long other machines take is not known";
  if (options.parts > 1 && !options.executor) return "--parts goes with --executor slurm";
  if (options.parts > 1 && options.proxy != "auto" && options.proxy != "dense")
    return "--parts divides depth maps: it goes with --proxy auto or dense";
  if (options.faces != 0 && options.faces < 4) return "--faces is 0 (as the proxy is) or at least 4";
  const std::vector<std::string>& passed = options.reconstruct_arguments;
  for (const char* other : {"--camera", "--focal-px", "--intrinsics"})
    if (!options.calibration.empty() && std::ranges::find(passed, other) != passed.end())
      return fmt::format("give one of --calibration and {}", other);
  if (options.threads < 0) return "--threads is 0 (all cores) or more";
  return {};
}

}  // namespace lumi
