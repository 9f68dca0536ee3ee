#include "reconstruct/compare_backends.h"

#include <fmt/format.h>

#include <map>
#include <vector>

#include "scene/files/atomic_file.h"
#include "scene/geometry/similarity3.h"

namespace lumi {
namespace fs = std::filesystem;

fs::path CamerasOf(Backend backend, const fs::path& scene_folder) {
  return scene_folder / "provenance" / fmt::format("cameras-{}.json", Name(backend));
}

namespace {

struct KeptCameras {
  std::string input;  // fingerprint
  double mean_reprojection_error_px = 0, seconds = 0;
  std::map<std::string, std::vector<double>> cam_from_world;  // by photo: quaternion w x y z, translation
};
void ListKeys(JsonKeys& j, KeptCameras& k) {
  j("cam_from_world", k.cam_from_world, "input", k.input, "mean_reprojection_error_px", k.mean_reprojection_error_px,
    "seconds", k.seconds);
}

std::vector<double> NumbersOf(const Rigid3& pose) {
  const auto& q = pose.rotation;
  const auto& t = pose.translation;
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

Rigid3 RigidOf(const std::vector<double>& v) {
  Rigid3 pose;
  pose.rotation = Eigen::Quaterniond(v[0], v[1], v[2], v[3]).normalized();
  pose.translation = Eigen::Vector3d(v[4], v[5], v[6]);
  return pose;
}

}  // namespace

std::optional<BackendComparison> KeepAndCompare(const Scene& scene, const ReconstructSummary& summary,
                                                const std::string& fingerprint, const fs::path& scene_folder) {
  KeptCameras mine{fingerprint, summary.mean_reprojection_error_px, summary.seconds, {}};
  for (const View& view : scene.views) mine.cam_from_world[view.name] = NumbersOf(view.cam_from_world);
  WriteTextAtomically(CamerasOf(summary.backend, scene_folder), JsonKeys(mine).Text(1) + "\n");

  const Backend other = summary.backend == Backend::kColmap ? Backend::kFactorization : Backend::kColmap;
  const fs::path file = CamerasOf(other, scene_folder);
  std::error_code ec;
  if (!fs::exists(file, ec)) return std::nullopt;
  const auto json = JsonKeys::Parse(ReadText(file));
  // Ours, but a user may have edited it: what does not fit is not compared.
  KeptCameras theirs;
  if (!json || !json->Into(theirs) || theirs.input != fingerprint) return std::nullopt;
  std::vector<Rigid3> ours, others;
  for (const View& view : scene.views) {
    const auto it = theirs.cam_from_world.find(view.name);
    if (it == theirs.cam_from_world.end()) continue;
    if (it->second.size() != 7) return std::nullopt;
    ours.push_back(view.cam_from_world);
    others.push_back(RigidOf(it->second));
  }
  if (ours.size() < 3) return std::nullopt;
  const PoseErrors errors = ComparePoses(ours, others);
  return BackendComparison{other,
                           static_cast<int>(ours.size()),
                           errors.centre_rms_percent,
                           errors.rotation_rms_deg,
                           theirs.mean_reprojection_error_px,
                           theirs.seconds};
}

}  // namespace lumi
