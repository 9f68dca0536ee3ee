#include "tests/benchmark/truth.h"

#include <sstream>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/transforms_json.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

std::string Stem(const fs::path& name) { return name.filename().stem().string(); }

Rigid3 ReadCameraFile(const fs::path& path) {
  std::istringstream text(ReadText(path));
  double skipped;
  for (int i = 0; i < 12; ++i) text >> skipped;  // K, then 0 0 0
  Eigen::Matrix3d M;
  Eigen::Vector3d centre;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) text >> M(row, column);
  for (int i = 0; i < 3; ++i) text >> centre[i];
  if (!text) throw InputError(path, "is no camera: 24 numbers are expected");
  const Eigen::Quaterniond rotation(Eigen::Matrix3d(M.transpose()));
  return {rotation.normalized(), -(rotation.normalized() * centre)};
}

}  // namespace

TruePoses ReadTruePoses(const fs::path& path) {
  TruePoses poses;
  if (fs::is_directory(path))
    for (const auto& entry : fs::directory_iterator(path))
      if (entry.path().extension() == ".camera") poses[Stem(entry.path().stem())] = ReadCameraFile(entry.path());
  if (!poses.empty()) return poses;
  const auto model = fs::is_directory(path) ? FindColmapModel(path) : std::nullopt;
  if (fs::is_directory(path) && !model) throw InputError(path, "holds neither NAME.camera files nor a COLMAP model");
  const Scene truth = model ? ReadColmapModel(*model) : ReadTransformsJson(path);
  for (const View& view : truth.views) poses[Stem(view.name)] = view.cam_from_world;
  return poses;
}

std::optional<PoseErrors> CompareWithTruth(const Scene& scene, const TruePoses& truth) {
  std::vector<Rigid3> estimated, true_poses;
  for (const View& view : scene.views) {
    const auto it = truth.find(Stem(view.name));
    if (it == truth.end()) continue;
    estimated.push_back(view.cam_from_world);
    true_poses.push_back(it->second);
  }
  if (estimated.size() < 3) return std::nullopt;
  return ComparePoses(estimated, true_poses);
}

}  // namespace lumi
