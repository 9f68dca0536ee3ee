// Which photos a picture shows, and how large.
#pragma once

#include <vector>

#include "render/photos/photo_cache.h"
#include "render/radiance/frame_plan.h"
#include "render/radiance/proxy_tracer.h"
#include "render/radiance/sparse/candidate_plan.h"

namespace lumi {

// The photos of the plan's cells, those of the most cells first. A photo may be halved as often as leaves it, where it
// shows points that its cells see, 1.4 pixels or more for each of the view's: what lies nearer than that between these
// points is less sharp than it could be.
std::vector<WantedPhoto> PhotosWanted(const CandidatePlan& plan, const ViewSetup& setup, const ProxyTracer& tracer);

}  // namespace lumi
