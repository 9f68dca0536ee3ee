// Photos without EXIF are mapped as one lens's, and where the points contradict that, as several lenses'.
#pragma once

#include "reconstruct/mapping.h"

namespace lumi {

// MapScene, and where it shows photos that share a camera for want of EXIF but were not taken by one lens (lenses.h),
// or places fewer than nine in ten: once more with a camera a photo, those alike shared again afterwards. The second
// way is taken where it places more photos, or as many with clearly smaller errors. A video's lens is one. Throws as
// MapScene does.
Mapping MapScenePerLens(const Capture& capture, const CameraPlan& cameras, const Features& features,
                        const ColmapJob& job);

}  // namespace lumi
