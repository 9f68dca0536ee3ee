// How thorough a run of the whole pipeline is: what the dials of its stages are set to together.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pipeline/options.h"

namespace lumi {

struct PipelineQuality {
  std::string name;                    // "draft"
  std::string cameras_in_words;        // empty: as by default
  std::vector<std::string> cameras;    // options of lumi-reconstruct and their values
  std::optional<int> depth_width_px;   // of lumi-proxy auto's depth maps; 0: none are made; no value: as by default
  double camera_seconds_a_photo = 0;   // about what the cameras take on two cores: so much a photo ...
  double camera_seconds_a_square = 0;  // ... and so much times the photos' number squared
};

// Cheapest first.
std::span<const PipelineQuality> PipelineQualities();

// What a run without --minutes does.
const PipelineQuality& UsualQuality();

// Whether the input brings its cameras or the options do (--poses, --rig): a quality then changes nothing about how
// they are found.
bool CamerasAreGiven(const PipelineOptions& options);

// What the user set himself stays. `cameras_given`: only the proxy differs.
PipelineOptions WithQuality(PipelineOptions options, const PipelineQuality& quality, bool cameras_given);

// Those that differ for these options, the cheapest of equal ones.
std::vector<PipelineQuality> QualitiesFor(const PipelineOptions& options, bool cameras_given);

// "small features, no depth maps": what of it counts for these options.
std::string InWords(const PipelineQuality& quality, const PipelineOptions& options, bool cameras_given);

// Photos below a folder, as lumi-reconstruct counts them; 0 for a video.
int CountPhotos(const std::filesystem::path& input);

// Seconds that finding the cameras is expected to take: as measured on two cores, in proportion to the cores.
double ExpectedCameraSeconds(const PipelineQuality& quality, int photos, int threads);

// The same of depth maps with what is made of them. `width`: no value: as auto takes it (proxy/commands.h).
double ExpectedDepthSeconds(std::optional<int> width, int photos, int threads);

// For M minutes: the most thorough whose cameras are expected to take at most two fifths of them; the cheapest where
// none is. `photos`: 0 where the cameras are given or the input is a video, whose keyframes nobody knows yet: the
// quality "full".
const PipelineQuality& QualityForMinutes(double minutes, int photos, int threads);

}  // namespace lumi
