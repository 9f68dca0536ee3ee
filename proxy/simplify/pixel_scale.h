// How large what is simplified is in the photos: a scene's backdrop is most of its size and hardly any of its pixels.
#pragma once

#include <vector>

#include "proxy/points.h"
#include "scene/geometry/mesh.h"

namespace lumi {

// Of each face, pixels that a world unit there takes in the photo that shows it largest: the focal length over the
// depth of the face's middle, over the photos whose frame it lies in. Nothing hides anything. A face in no frame counts
// as in the least of those that are. `views` may be empty: 1 everywhere.
std::vector<double> PixelScale(const Mesh& mesh, const std::vector<ProxyView>& views);

}  // namespace lumi
