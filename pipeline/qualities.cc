#include "pipeline/qualities.h"

#include <algorithm>
#include <array>

namespace lumi {
namespace {

// Camera seconds: through a real capture of 50 photos and, of `quick`, simulated walks of 200 and 1,000 photos
// (docs/pipeline.md): within a factor of two.
const std::array<PipelineQuality, 5>& Qualities() {
  static const std::array<PipelineQuality, 5> all{{
      {"draft", "small features, no depth maps", {"--quality", "low"}, 0, 0.6, 0.0008},
      {"quick", "no depth maps", {}, 0, 0.8, 0.0011},
      {"standard", "depth maps in 4 s a photo", {}, 4, 0.8, 0.0011},
      {"full", "depth maps in 15 s a photo", {}, 15, 0.8, 0.0011},
      {"careful",
       "many features, COLMAP's own bounds, depth maps in 60 s a photo",
       {"--quality", "high", "--mapper", "careful"},
       60,
       2.5,
       0.004},
  }};
  return all;
}
constexpr std::size_t kDefault = 3;
constexpr double kMeasuredThreads = 2, kCameraShare = 0.4;

bool Given(const std::vector<std::string>& arguments, const std::string& option) {
  return std::ranges::any_of(
      arguments, [&](const std::string& a) { return a == option || a.starts_with(option + "="); });
}

}  // namespace

std::span<const PipelineQuality> PipelineQualities() { return Qualities(); }

PipelineOptions WithQuality(PipelineOptions options, const PipelineQuality& quality, bool has_cameras) {
  if (!has_cameras)
    for (std::size_t i = 0; i + 1 < quality.cameras.size(); i += 2)
      // The mapper is COLMAP's.
      if (!Given(options.reconstruct_arguments, quality.cameras[i]) &&
          (quality.cameras[i] != "--mapper" || !Given(options.reconstruct_arguments, "--backend")))
        options.reconstruct_arguments.insert(options.reconstruct_arguments.end(),
                                             {quality.cameras[i], quality.cameras[i + 1]});
  if (!options.proxy_minutes) options.depth_seconds_a_photo = quality.depth_seconds_a_photo;
  return options;
}

std::vector<PipelineQuality> QualitiesFor(const PipelineOptions& options, bool has_cameras) {
  std::vector<PipelineQuality> different;
  std::vector<PipelineOptions> settings;
  for (const PipelineQuality& quality : Qualities()) {
    const PipelineOptions with = WithQuality(options, quality, has_cameras);
    const bool no_budget = options.proxy != "auto" || options.proxy_minutes;
    if (std::ranges::any_of(settings, [&](const PipelineOptions& other) {
          return other.reconstruct_arguments == with.reconstruct_arguments &&
                 (no_budget || other.depth_seconds_a_photo == with.depth_seconds_a_photo);
        }))
      continue;
    settings.push_back(with);
    different.push_back(quality);
  }
  return different;
}

double ExpectedCameraSeconds(const PipelineQuality& quality, int photos, int threads) {
  const double n = photos;
  return (quality.camera_seconds_a_photo * n + quality.camera_seconds_a_square * n * n) * kMeasuredThreads /
         std::max(1, threads);
}

const PipelineQuality& QualityForMinutes(double minutes, int photos, int threads) {
  const auto& all = Qualities();
  if (photos <= 0) return all[kDefault];
  for (std::size_t i = all.size(); i-- > 0;)
    if (ExpectedCameraSeconds(all[i], photos, threads) <= kCameraShare * 60 * minutes) return all[i];
  return all.front();
}

}  // namespace lumi
