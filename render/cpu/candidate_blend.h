// Blends a CandidatePlan on the CPU: every pixel weighs its cell's photos (weights.h, the same formulas), 16 pixels at
// a time.
#pragma once

#include "render/cpu/sparse_blend.h"
#include "render/radiance/sparse/candidate_plan.h"

namespace lumi {

// Whether BlendCandidates weighs with these settings (not: falling leaves, alpha = 0); where not, PlanCellPixels does.
bool CanBlendCandidates(const RadianceSettings& settings);

// Into `image`: RGBA, [0,1], premultiplied, the view's size, zero before. `tracer` finds the pixels' points on a fine
// mesh. `visibility`: nullptr where it is off. Parallel inside.
void BlendCandidates(const CandidatePlan& plan, const ViewSetup& setup, const ProxyTracer& tracer,
                     const VisibilityMaps* visibility, const BlendSources& sources, ImageF& image);

}  // namespace lumi
