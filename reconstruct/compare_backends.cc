#include "reconstruct/compare_backends.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "scene/files/atomic_file.h"
#include "scene/geometry/similarity3.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

fs::path CamerasOf(Backend backend, const fs::path& scene_folder) { return scene_folder / "provenance" / fmt::format("cameras-{}.json", Name(backend)); }

nlohmann::json ToJson(const Rigid3& pose) {
  const auto &q = pose.rotation;
  const auto &t = pose.translation;
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

Rigid3 PoseFromJson(const nlohmann::json& j) {
  Rigid3 pose;
  pose.rotation = Eigen::Quaterniond(j.at(0), j.at(1), j.at(2), j.at(3)).normalized();
  pose.translation = Eigen::Vector3d(j.at(4), j.at(5), j.at(6));
  return pose;
}

}  // namespace

std::optional<BackendComparison> KeepAndCompare(const Scene& scene, const ReconstructSummary& summary, const std::string& fingerprint, const fs::path& scene_folder) {
  nlohmann::json mine = {{"input", fingerprint}, {"mean_reprojection_error_px", summary.mean_reprojection_error_px}, {"seconds", summary.seconds}};
  for (const View& view : scene.views) mine["cam_from_world"][view.name] = ToJson(view.cam_from_world);
  WriteTextAtomically(CamerasOf(summary.backend, scene_folder), mine.dump(1) + "\n");

  const Backend other = summary.backend == Backend::kColmap ? Backend::kFactorization : Backend::kColmap;
  const fs::path file = CamerasOf(other, scene_folder);
  std::error_code ec;
  if (!fs::exists(file, ec)) return std::nullopt;
  const auto theirs = nlohmann::json::parse(ReadText(file), nullptr, false);
  // Ours, but a user may have edited it: what does not fit is not compared.
  try {
    if (theirs.at("input") != fingerprint) return std::nullopt;
    std::vector<Rigid3> ours, others;
    for (const View& view : scene.views) {
      if (!theirs.at("cam_from_world").contains(view.name)) continue;
      ours.push_back(view.cam_from_world);
      others.push_back(PoseFromJson(theirs.at("cam_from_world").at(view.name)));
    }
    if (ours.size() < 3) return std::nullopt;
    const PoseErrors errors = ComparePoses(ours, others);
    BackendComparison c;
    c.backend = other;
    c.views = static_cast<int>(ours.size());
    c.centre_rms_percent = errors.centre_rms_percent;
    c.rotation_rms_deg = errors.rotation_rms_deg;
    c.mean_reprojection_error_px = theirs.at("mean_reprojection_error_px");
    c.seconds = theirs.at("seconds");
    return c;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  }
}

}  // namespace lumi
