#include "tests/benchmark/truth.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <sstream>

#include "scene/files/atomic_file.h"
#include "scene/files/colmap_model.h"
#include "scene/files/transforms_json.h"
#include "scene/geometry/median.h"
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

// Of the photos that both have.
struct CommonPoses {
  CommonPoses(const Scene& scene, const TruePoses& true_poses) {
    for (const View& view : scene.views) {
      const auto it = true_poses.find(Stem(view.name));
      if (it == true_poses.end()) continue;
      names.push_back(view.name);
      estimated.push_back(view.cam_from_world);
      truth.push_back(it->second);
    }
  }
  std::vector<std::string> names;
  std::vector<Rigid3> estimated, truth;
};

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
  const CommonPoses common(scene, truth);
  if (common.names.size() < 3) return std::nullopt;
  return ComparePoses(common.estimated, common.truth);
}

std::vector<std::string> FarOff(const Scene& scene, const TruePoses& truth, double factor) {
  const CommonPoses common(scene, truth);
  const std::size_t n = common.names.size();
  if (n < 3) return {};
  std::vector<double> errors;
  const auto align = [&](const std::vector<std::size_t>& by) {
    std::vector<Rigid3> estimated, wanted;
    for (const std::size_t i : by) estimated.push_back(common.estimated[i]), wanted.push_back(common.truth[i]);
    const Similarity3 truth_from_estimate = AlignPoses(estimated, wanted);
    errors.clear();
    for (std::size_t i = 0; i < n; ++i)
      errors.push_back(
          (truth_from_estimate * common.estimated[i].OriginInSource() - common.truth[i].OriginInSource()).norm());
    return Median(std::vector<double>(errors));
  };
  // The least median over alignments by three cameras (Rousseeuw 1984), then by the better half.
  std::vector<std::size_t> best(n);
  std::iota(best.begin(), best.end(), 0);
  double least = align(best);
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<std::size_t> three;
    while (three.size() < 3)
      if (const std::size_t i = random() % n; std::ranges::find(three, i) == three.end()) three.push_back(i);
    if (const double median = align(three); median < least) least = median, best = three;
  }
  for (int round = 0; round < 4; ++round) {
    align(best);
    best.resize(n);
    std::iota(best.begin(), best.end(), 0);
    std::ranges::sort(best, {}, [&](std::size_t i) { return errors[i]; });
    best.resize(std::max<std::size_t>(3, (n + 1) / 2));
  }
  align(best);
  const double limit = factor * Median(errors);
  std::vector<std::string> far;
  for (std::size_t i = 0; i < n; ++i)
    if (errors[i] > limit) far.push_back(common.names[i]);
  return far;
}

std::size_t FarOffUnnamed(const Scene& scene, const TruePoses& truth, const ReconstructSummary& summary) {
  constexpr double kFar = 10;
  std::vector<std::string> far = FarOff(scene, truth, kFar);
  for (const CameraStanding& s : summary.standings)
    if (!s.remark.empty()) std::erase(far, s.name);
  return far.size();
}

}  // namespace lumi
