#include "render/holdout/evaluation_proxy.h"

#include <algorithm>

#include "render/holdout/holdout.h"
#include "scene/files/scene_folder.h"

namespace lumi {

std::string ProxyFor(const std::filesystem::path& scene_folder, const std::string& name, int holdout, ViewId photo,
                     int photos) {
  const auto there = [&](const std::string& proxy) {
    std::error_code error;
    return std::filesystem::is_regular_file(ProxyPath(scene_folder, proxy), error);
  };
  if (holdout == kHoldoutEach) {
    for (int k = 0; k < std::min(kProxiesForEach, photos); ++k)
      if (!there(ProxyWithoutEach(name, k))) return name;
    return ProxyWithoutEach(name, photo.value % kProxiesForEach);
  }
  for (int m = holdout; m >= 2; --m)
    if (holdout % m == 0 && there(ProxyWithout(name, m))) return ProxyWithout(name, m);
  return name;
}

}  // namespace lumi
