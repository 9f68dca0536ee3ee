#include "render/holdout/evaluation_proxy.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "render/holdout/holdout.h"
#include "scene/files/provenance.h"
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

std::string RemarkOnProxyThatSaw(const std::filesystem::path& scene_folder, const std::string& name, int holdout) {
  if (IsMeshFile(name)) return {};  // nobody knows what a file was made of
  const auto record = ReadProvenance(scene_folder, "proxy-" + name);
  const auto kind = record ? record->options.find("kind") : std::map<std::string, std::string>::const_iterator();
  if (!record || kind == record->options.end() || record->options.contains("leave_out")) return {};
  if (!std::set<std::string>{"delaunay", "dense", "planes", "hull"}.contains(kind->second)) return {};
  const std::string without =
      kind->second == "hull"
          ? std::string()
          : fmt::format("; lumi-proxy {} {} --leave-out {} makes one to judge by", kind->second, scene_folder.string(),
                        holdout == kHoldoutEach ? "each" : std::to_string(holdout));
  return fmt::format("{} was made of all photos, those held out among them, which flatters it{}", name, without);
}

}  // namespace lumi
