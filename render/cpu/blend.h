// Blends a FramePlan's cameras at each sample from the photographs, on the CPU.
#pragma once

#include <span>
#include <vector>

#include "render/photos/photo_set.h"
#include "render/radiance/frame_plan.h"
#include "scene/model/image.h"

namespace lumi {

// Bilinear sample of RGB (code values 0..255) at (u, v) in [0,1]: fractions of the photo's width and height, which mean
// the same place on every level. Clamped to the photo's own pixels; trilinear between two levels for level > 0.
Eigen::Array3f SamplePhoto(const Photo& photo, float u, float v, float level);

// Writes the plan's window into `image` (RGBA, [0,1], premultiplied, the whole view's size). `gains`: a factor on each
// photo's colours; empty: 1. With field of view off, a photo contributes nothing beyond its border: colour and alpha
// are missing there. `seen`: how often each photo is halved at least; empty: as it is.
void BlendColor(const FramePlan& plan, const ViewSetup& setup, const std::vector<Photo>& photos,
                const std::vector<float>& gains, ImageF& image, std::span<const int> seen = {});

// The same with a constant colour for each source (false colour); colors[j] is RGB in [0,1].
void BlendConstants(const FramePlan& plan, const ViewSetup& setup, const std::vector<Eigen::Vector3f>& colors,
                    ImageF& image);

}  // namespace lumi
