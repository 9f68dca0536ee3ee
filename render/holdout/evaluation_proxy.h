// Which proxy a held-out photo is rendered over. A proxy that was made of all photos has seen the one that it is judged
// by; where the scene has one that was made without it, that one stands in.
#pragma once

#include <filesystem>
#include <string>

#include "scene/files/evaluation_proxy.h"
#include "scene/model/scene.h"

namespace lumi {

// The name of the proxy over which `photo` is rendered in an evaluation of `name`; `name` itself where no other stands
// in.
// holdout N: NAME-without-N; else NAME-without-M of the largest M that divides N, whose photos are more and hold all of
// N's (of either fold). kHoldoutEach: NAME-without-each-K-of-5, K = photo mod 5, where all five are there (of fewer
// `photos` than that, as many).
std::string ProxyFor(const std::filesystem::path& scene_folder, const std::string& name, int holdout, ViewId photo,
                     int photos = kProxiesForEach);

}  // namespace lumi
