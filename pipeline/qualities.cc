#include "pipeline/qualities.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>

#include "pipeline/input_kind.h"
#include "scene/files/image_io.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Camera seconds: through a real capture of 50 photos and, of `quick`, simulated walks of 200 and 1,000 photos
// (docs/pipeline.md): within a factor of two.
const std::array<PipelineQuality, 5>& Qualities() {
  static const std::array<PipelineQuality, 5> all{{
      {"draft", "few features in small photos", {"--quality", "low"}, 0, 0.4, 0.0005},
      {"quick", "", {}, 0, 0.8, 0.0011},
      {"standard", "", {}, 320, 0.8, 0.0011},
      {"full", "", {}, {}, 0.8, 0.0011},
      {"careful", "many features, COLMAP's own bounds", {"--quality", "high", "--mapper", "careful"}, 640, 1.3, 0.004},
  }};
  return all;
}
constexpr std::size_t kFull = 3;
constexpr double kMeasuredThreads = 2, kCameraShare = 0.4;

// The value of an option among arguments that are passed on, "--name value" or "--name=value"; none: not given.
std::optional<std::string> ValueOf(const std::vector<std::string>& arguments, const std::string& option) {
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == option) return i + 1 < arguments.size() ? arguments[i + 1] : "";
    if (arguments[i].starts_with(option + "=")) return arguments[i].substr(option.size() + 1);
  }
  return std::nullopt;
}

// Options of the cameras that this quality sets.
std::vector<std::string> CameraDials(const PipelineOptions& options, const PipelineQuality& quality) {
  std::vector<std::string> dials;
  for (std::size_t i = 0; i + 1 < quality.cameras.size(); i += 2) {
    const std::string& name = quality.cameras[i];
    const bool no_mapper = ValueOf(options.reconstruct_arguments, "--backend") == "factorization";
    if (!ValueOf(options.reconstruct_arguments, name) && !(name == "--mapper" && no_mapper))
      dials.insert(dials.end(), {name, quality.cameras[i + 1]});
  }
  return dials;
}

bool DepthIsDialled(const PipelineOptions& options) {
  return options.proxy == "auto" && !options.proxy_minutes && !options.depth_width_px;
}

}  // namespace

std::span<const PipelineQuality> PipelineQualities() { return Qualities(); }

const PipelineQuality& UsualQuality() { return Qualities()[kFull]; }

bool CamerasAreGiven(const PipelineOptions& options) {
  if (ClassifyInput(options.input) != InputKind::kCapture) return true;
  if (ValueOf(options.reconstruct_arguments, "--rig")) return true;
  const auto poses = ValueOf(options.reconstruct_arguments, "--poses");
  if (poses) return *poses != "none";
  std::error_code error;
  return options.input.extension() == ".json" || fs::is_regular_file(options.input / "transforms.json", error);
}

PipelineOptions WithQuality(PipelineOptions options, const PipelineQuality& quality, bool cameras_given) {
  if (!cameras_given) {
    const std::vector<std::string> dials = CameraDials(options, quality);
    options.reconstruct_arguments.insert(options.reconstruct_arguments.end(), dials.begin(), dials.end());
  }
  if (!DepthIsDialled(options)) return options;
  if (quality.depth_width_px == 0)
    options.proxy_minutes = 0;
  else
    options.depth_width_px = quality.depth_width_px;
  return options;
}

std::vector<PipelineQuality> QualitiesFor(const PipelineOptions& options, bool cameras_given) {
  std::vector<PipelineQuality> different;
  std::vector<PipelineOptions> settings;
  for (const PipelineQuality& quality : Qualities()) {
    // What "careful" adds is in the cameras: depth maps are as large by default, but for many photos.
    if (cameras_given && &quality == &Qualities().back()) continue;
    const PipelineOptions with = WithQuality(options, quality, cameras_given);
    if (std::ranges::any_of(settings, [&](const PipelineOptions& other) {
          return other.reconstruct_arguments == with.reconstruct_arguments &&
                 other.proxy_minutes == with.proxy_minutes && other.depth_width_px == with.depth_width_px;
        }))
      continue;
    settings.push_back(with);
    different.push_back(quality);
  }
  return different;
}

std::string InWords(const PipelineQuality& quality, const PipelineOptions& options, bool cameras_given) {
  std::string words;
  if (!cameras_given && !CameraDials(options, quality).empty()) words = quality.cameras_in_words;
  if (DepthIsDialled(options) && quality.depth_width_px)
    words += (words.empty() ? "" : ", ") + (*quality.depth_width_px > 0
                                                ? fmt::format("depth maps {} px wide", *quality.depth_width_px)
                                                : std::string("no depth maps"));
  return words.empty() ? "as by default" : words;
}

int CountPhotos(const fs::path& input) {
  std::error_code error;
  std::set<fs::path> photos, raw;
  constexpr auto kAll = fs::directory_options::follow_directory_symlink | fs::directory_options::skip_permission_denied;
  for (fs::recursive_directory_iterator it(input, kAll, error), end; !error && it != end; it.increment(error)) {
    if (it->path().filename().string().starts_with(".")) {
      if (it->is_directory(error)) it.disable_recursion_pending();
      continue;
    }
    if (!HasImageExtension(it->path())) continue;
    (HasRawExtension(it->path()) ? raw : photos).insert(it->path().parent_path() / it->path().stem());
  }
  photos.insert(raw.begin(), raw.end());  // a RAW file beside its JPEG is no other photo
  return static_cast<int>(photos.size());
}

double ExpectedCameraSeconds(const PipelineQuality& quality, int photos, int threads) {
  const double n = photos;
  return (quality.camera_seconds_a_photo * n + quality.camera_seconds_a_square * n * n) * kMeasuredThreads /
         std::max(1, threads);
}

double ExpectedDepthSeconds(std::optional<int> width, int photos, int threads) {
  // With their meshes, 640 pixels wide: 10 to 15 s a photo on two cores. More than so many photos have none.
  constexpr double kSecondsAPhoto = 15, kMeasuredWidth = 640, kMostSeconds = 20 * 60, kLeastWidth = 320;
  constexpr int kMostPhotos = 1000;
  const auto seconds = [&](double w) { return kSecondsAPhoto * photos * (w / kMeasuredWidth) * (w / kMeasuredWidth); };
  const double all = width ? seconds(*width)
                     : photos > kMostPhotos
                         ? 0
                         : std::max(seconds(kLeastWidth), std::min(kMostSeconds, seconds(kMeasuredWidth)));
  return all * kMeasuredThreads / std::max(1, threads);
}

const PipelineQuality& QualityForMinutes(double minutes, int photos, int threads) {
  const auto& all = Qualities();
  if (photos <= 0) return all[kFull];
  for (std::size_t i = all.size(); i-- > 0;)
    if (ExpectedCameraSeconds(all[i], photos, threads) <= kCameraShare * 60 * minutes) return all[i];
  return all.front();
}

}  // namespace lumi
