// Which proxy a held-out photo is rendered over. A proxy made from all photos has already seen the held-out photo; if
// the scene has a proxy made without that photo, it is used instead.
#pragma once

#include <filesystem>
#include <string>

#include "scene/files/evaluation_proxy.h"
#include "scene/model/scene.h"

namespace lumi {

// The name of the proxy over which `photo` is rendered in an evaluation of `name`; `name` itself if there is no other.
// holdout N: NAME-without-N, else NAME-without-M for the largest M that divides N: its held-out photos include all of
// N's (of either fold). kHoldoutEach: NAME-without-each-K-of-5, K = photo mod 5, if all five exist (with fewer
// `photos`, that many).
std::string ProxyFor(const std::filesystem::path& scene_folder, const std::string& name, int holdout, ViewId photo,
                     int photos = kProxiesForEach);

// What to say of a proxy that lumi-proxy made of all photos and whose shape follows them: it has seen those that it is
// judged by. Empty where that is not known.
std::string RemarkOnProxyThatSaw(const std::filesystem::path& scene_folder, const std::string& name, int holdout);

}  // namespace lumi
