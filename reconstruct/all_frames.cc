#include "reconstruct/all_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/calib3d.hpp>
#include <set>

#include "reconstruct/colmap_database.h"
#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Keyframes on each side that a frame is matched with.
constexpr std::size_t kNeighbours = 2;
// A frame is placed by at least so many points that agree within the error (COLMAP's own bound is 30 of 12 px).
constexpr int kMinInliers = 20;
constexpr double kMaxErrorPx = 4;
constexpr int kRansacRounds = 1000;
constexpr double kRansacConfidence = 0.9999;

using KeyframePoints = std::map<std::pair<double, double>, std::int32_t>;  // keypoint -> point

struct Placed {
  bool ok = false;
  int inliers = 0;
  Rigid3 cam_from_world;
  std::vector<std::pair<std::int32_t, Eigen::Vector2d>> observations;  // point, pixel
};

// Pose from points and their pixels under a lens that is known: RANSAC over P3P, then Levenberg-Marquardt over the
// inliers (OpenCV), on pixels with the lens taken away.
Placed Resection(const std::vector<std::pair<std::int32_t, Eigen::Vector2d>>& seen, const std::vector<Point>& points, const Camera& camera) {
  Placed placed;
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> pixels;
  std::vector<std::size_t> source;
  const Eigen::Matrix3d K = camera.K();
  // Centred at the points: OpenCV's solver works on absolute coordinates.
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& [point, x] : seen) middle += points[static_cast<std::size_t>(point)].x_in_world / static_cast<double>(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto n = camera.Normalized(seen[i].second);
    if (!n) continue;
    const Eigen::Vector3d X = points[static_cast<std::size_t>(seen[i].first)].x_in_world - middle;
    const Eigen::Vector2d x = (K * n->homogeneous()).head<2>();
    world.emplace_back(X.x(), X.y(), X.z());
    pixels.emplace_back(x.x(), x.y());
    source.push_back(i);
  }
  if (static_cast<int>(world.size()) < kMinInliers) {
    placed.inliers = static_cast<int>(world.size());
    return placed;
  }
  // K's principal point and the pixels share one origin, so no conversion is due.
  const cv::Matx33d cv_K(K(0, 0), K(0, 1), K(0, 2), K(1, 0), K(1, 1), K(1, 2), K(2, 0), K(2, 1), K(2, 2));
  cv::Vec3d rotation, translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(world, pixels, cv_K, cv::noArray(), rotation, translation, false, kRansacRounds, static_cast<float>(kMaxErrorPx), kRansacConfidence, inliers, cv::SOLVEPNP_P3P))
    return placed;
  placed.inliers = static_cast<int>(inliers.size());
  if (placed.inliers < kMinInliers) return placed;
  std::vector<cv::Point3d> world_in;
  std::vector<cv::Point2d> pixels_in;
  for (const int i : inliers) {
    world_in.push_back(world[static_cast<std::size_t>(i)]);
    pixels_in.push_back(pixels[static_cast<std::size_t>(i)]);
  }
  cv::solvePnPRefineLM(world_in, pixels_in, cv_K, cv::noArray(), rotation, translation);
  const Eigen::Vector3d r(rotation[0], rotation[1], rotation[2]), t(translation[0], translation[1], translation[2]);
  if (!r.allFinite() || !t.allFinite()) return placed;
  const double angle = r.norm();
  placed.cam_from_world.rotation = angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, r / angle)) : Eigen::Quaterniond::Identity();
  placed.cam_from_world.translation = t - placed.cam_from_world.rotation * middle;
  for (const int i : inliers) placed.observations.push_back(seen[source[static_cast<std::size_t>(i)]]);
  placed.ok = true;
  return placed;
}

// The keyframes nearest in time to a frame.
std::vector<std::string> NearKeyframes(const std::vector<std::string>& keyframes, const std::string& frame) {
  const auto at = std::lower_bound(keyframes.begin(), keyframes.end(), frame);
  const auto before = std::min<std::size_t>(kNeighbours, static_cast<std::size_t>(at - keyframes.begin()));
  const auto after = std::min<std::size_t>(kNeighbours, static_cast<std::size_t>(keyframes.end() - at));
  return {at - static_cast<std::ptrdiff_t>(before), at + static_cast<std::ptrdiff_t>(after)};
}

}  // namespace

void RegisterAllFrames(Scene& scene, const Capture& all_frames, const Features& keyframe_features, const ReconstructOptions& options,
                       const fs::path& work_folder, ColmapProgram& colmap, std::vector<MissingPhoto>* missing, ProgressSink& sink) {
  std::vector<std::string> keyframes;
  for (const View& view : scene.views) keyframes.push_back(view.name);
  std::set<std::string> known(keyframes.begin(), keyframes.end());
  std::vector<std::string> frames;
  for (const Photo& photo : all_frames.photos)
    if (!known.count(photo.name)) frames.push_back(photo.name);

  // A database of its own, grown from the keyframes' one: that one stays what a rerun compares with.
  const fs::path database = work_folder / "all_frames.db", key_file = work_folder / "all_frames.key";
  const std::string key = Fingerprint(work_folder / "features.json") + " " + Fingerprint(work_folder / "keyframes.json");
  std::error_code ec;
  if (!fs::exists(key_file, ec) || ReadText(key_file) != key || !ColmapDatabase::IsDatabase(database)) {
    for (const char* suffix : {"", "-journal", "-wal", "-shm"}) fs::remove(database.string() + suffix, ec);
    WriteFileAtomically(database, [&](const fs::path& t) { fs::copy_file(keyframe_features.database, t, fs::copy_options::overwrite_existing); });
    WriteTextAtomically(key_file, key);
  }
  const FeatureLimits limits = LimitsFor(options, all_frames.photos.size());
  const fs::path list = work_folder / "all_frames.txt", pairs = work_folder / "all_frames_pairs.txt";
  std::string names, pair_lines;
  for (const auto& frame : frames) {
    names += frame + "\n";
    for (const auto& keyframe : NearKeyframes(keyframes, frame)) pair_lines += frame + " " + keyframe + "\n";
  }
  WriteTextAtomically(list, names);
  WriteTextAtomically(pairs, pair_lines);
  const std::string gpu = colmap.has_cuda() ? "1" : "0";
  const std::string threads = options.threads > 0 ? std::to_string(options.threads) : "-1";
  if (!frames.empty()) {
    std::vector<ColmapOption> extract = {{"database_path", database.string()},
                                         {"image_path", all_frames.folder.string()},
                                         {"image_list_path", list.string()},
                                         {"ImageReader.single_camera", "1"},
                                         {"SiftExtraction.use_gpu", gpu},
                                         {"SiftExtraction.max_image_size", std::to_string(limits.max_image_size_px)},
                                         {"SiftExtraction.max_num_features", std::to_string(limits.max_features)},
                                         {"SiftExtraction.num_threads", threads}};
    colmap.Run("feature_extractor", extract, "features of all frames (COLMAP)", static_cast<long>(frames.size()));
    colmap.Run("matches_importer",
               {{"database_path", database.string()}, {"match_list_path", pairs.string()}, {"match_type", "pairs"}, {"SiftMatching.use_gpu", gpu}, {"SiftMatching.num_threads", threads}},
               "matching all frames (COLMAP)", 0);
  }

  const ColmapDatabase db(database);
  std::map<std::string, DatabaseImage> image_of;
  for (const auto& image : db.Images()) image_of[image.name] = image;
  // Which keypoint of a keyframe is which point: observations lie exactly at keypoints.
  std::map<std::string, KeyframePoints> points_of;
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    for (const Observation& o : scene.points[p].track)
      points_of[scene.views[static_cast<std::size_t>(o.view.value)].name][{o.x_px.x(), o.x_px.y()}] = static_cast<std::int32_t>(p);
  std::map<std::string, std::vector<std::int32_t>> point_of_keypoint;
  for (const auto& keyframe : keyframes) {
    auto& list_of = point_of_keypoint[keyframe];
    const auto image = image_of.find(keyframe);
    if (image == image_of.end()) continue;
    for (const auto& x : db.Keypoints(image->second.id)) {
      const auto it = points_of[keyframe].find({x.x(), x.y()});
      list_of.push_back(it == points_of[keyframe].end() ? -1 : it->second);
    }
  }
  // All frames of a video share the keyframes' camera.
  const CameraId camera_id = scene.views.front().camera;
  const Camera camera = scene.CameraOf(scene.views.front());

  std::vector<std::vector<std::pair<std::int32_t, Eigen::Vector2d>>> seen(frames.size());
  std::vector<int> features(frames.size(), 0);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const auto image = image_of.find(frames[f]);
    if (image == image_of.end()) continue;
    features[f] = image->second.keypoints;
    const auto keypoints = db.Keypoints(image->second.id);
    std::set<std::pair<std::int32_t, int>> unique;
    for (const auto& keyframe : NearKeyframes(keyframes, frames[f])) {
      const auto& of_keypoint = point_of_keypoint[keyframe];
      const auto key_image = image_of.find(keyframe);
      if (key_image == image_of.end()) continue;
      for (const auto& [i, j] : db.Matches(image->second.id, key_image->second.id)) {
        if (i < 0 || j < 0 || static_cast<std::size_t>(i) >= keypoints.size() || static_cast<std::size_t>(j) >= of_keypoint.size()) continue;
        const std::int32_t point = of_keypoint[static_cast<std::size_t>(j)];
        if (point >= 0 && unique.emplace(point, i).second) seen[f].emplace_back(point, keypoints[static_cast<std::size_t>(i)]);
      }
    }
  }
  std::vector<Placed> placed(frames.size());
  Progress progress(sink, "placing all frames", static_cast<long>(frames.size()));
  ParallelFor(frames.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t f = begin; f < end; ++f) {
      placed[f] = Resection(seen[f], scene.points, camera);
      progress.Step();
    }
  });

  std::vector<View> views = scene.views;
  std::set<std::string> explained;
  for (const auto& m : *missing) explained.insert(m.name);
  for (std::size_t f = 0; f < frames.size(); ++f) {
    if (!placed[f].ok) {
      if (!explained.count(frames[f]))
        missing->push_back({frames[f], features[f] == 0 ? std::string("blurred or textureless (no features)")
                                                        : fmt::format("too few points of the keyframes in it ({} agree, {} are needed; {} features)", placed[f].inliers, kMinInliers, features[f]),
                            "film more slowly there, or ask for more --keyframes"});
      continue;
    }
    std::erase_if(*missing, [&](const MissingPhoto& m) { return m.name == frames[f]; });
    View view;
    view.name = frames[f];
    view.camera = camera_id;
    view.cam_from_world = placed[f].cam_from_world;
    const auto index = static_cast<std::int32_t>(views.size());
    std::set<std::int32_t> once;
    for (const auto& [point, x] : placed[f].observations)
      if (once.insert(point).second) scene.points[static_cast<std::size_t>(point)].track.push_back({ViewId{index}, x});
    views.push_back(std::move(view));
  }
  // Views are sorted by name; the observations follow.
  std::vector<std::size_t> order(views.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return views[a].name < views[b].name; });
  std::vector<std::int32_t> new_index(views.size());
  scene.views.clear();
  for (std::size_t i = 0; i < order.size(); ++i) {
    new_index[order[i]] = static_cast<std::int32_t>(i);
    scene.views.push_back(views[order[i]]);
  }
  for (Point& point : scene.points)
    for (Observation& o : point.track) o.view.value = new_index[static_cast<std::size_t>(o.view.value)];
  scene.image_folder = all_frames.folder;
  std::sort(missing->begin(), missing->end(), [](const auto& a, const auto& b) { return a.name < b.name; });
}

}  // namespace lumi
