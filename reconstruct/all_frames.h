// Every frame of a video gets a camera: resectioned against the points of the keyframes. What the frames then see of
// these points adjusts them, the keyframes' cameras and the lens, and the frames are placed again.
#pragma once

#include <vector>

#include "reconstruct/colmap_program.h"
#include "reconstruct/features.h"
#include "reconstruct/options.h"
#include "reconstruct/photos.h"
#include "scene/model/scene.h"

namespace lumi {

// `scene` holds the keyframes (distorted cameras, observations at COLMAP's keypoints); frames are added to it, with
// image_folder = the folder of all frames. lens_known: it stays as it is. Frames that get no camera are added to
// `missing`.
void RegisterAllFrames(Scene& scene, const Capture& all_frames, const Features& keyframe_features, bool lens_known,
                       const ColmapJob& job, std::vector<MissingPhoto>& missing);

}  // namespace lumi
