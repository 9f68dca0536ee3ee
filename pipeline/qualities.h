// How thorough a run of the whole pipeline is: what the dials of its stages are set to together.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "pipeline/options.h"

namespace lumi {

struct PipelineQuality {
  std::string name;                         // "draft"
  std::string says;                         // what it is, in words
  std::vector<std::string> cameras;         // options of lumi-reconstruct and their values
  double depth_seconds_a_photo = 0;         // that lumi-proxy auto may spend on depth maps; 0: none are made
  double camera_seconds_a_photo = 0;        // about what the cameras take: so much a photo ...
  double camera_seconds_a_square = 0;       // ... and so much times the photos' number squared; two cores
};

// Cheapest first.
std::span<const PipelineQuality> PipelineQualities();

// What the user set himself stays. `has_cameras`: the input brings them, so that only the proxy differs.
PipelineOptions WithQuality(PipelineOptions options, const PipelineQuality& quality, bool has_cameras);

// Of those that differ for this input: without cameras to be found, the cheapest of equal proxies.
std::vector<PipelineQuality> QualitiesFor(const PipelineOptions& options, bool has_cameras);

// Seconds that finding the cameras is expected to take: as measured on two cores, in proportion to the cores.
double ExpectedCameraSeconds(const PipelineQuality& quality, int photos, int threads);

// For M minutes: the most thorough whose cameras are expected to take at most two fifths of them; the cheapest where
// none is. `photos`: 0 where the input does not tell: the default quality.
const PipelineQuality& QualityForMinutes(double minutes, int photos, int threads);

}  // namespace lumi
