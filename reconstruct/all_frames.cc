#include "reconstruct/all_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <set>
#include <string>

#include "reconstruct/adjust_frames.h"
#include "reconstruct/colmap_database.h"
#include "reconstruct/own_features.h"
#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"
#include "scene/geometry/median.h"
#include "scene/program/parallel_each.h"
#include "scene/tracks/match_descriptors.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Keyframes on each side that a frame is matched with.
constexpr std::size_t kNeighbours = 2;
// COLMAP's own bounds on a match: the distance to the nearest descriptor over that to the second, and the cosine of the
// angle between two, which is at most 0.7.
constexpr double kMatchRatio = 0.8;
constexpr float kLeastSimilarity = 0.7648f;
// A frame is placed by at least so many points that agree within the error (COLMAP's own bound is 30 of 12 px).
constexpr int kMinInliers = 20;
constexpr double kMaxErrorPx = 4;
constexpr int kRansacRounds = 1000;
constexpr double kRansacConfidence = 0.9999;

using Sightings = std::vector<std::vector<std::pair<std::int32_t, Eigen::Vector2d>>>;  // of each frame: point, pixel
using KeyframePoints = std::map<std::pair<double, double>, std::int32_t>;              // keypoint -> point

using Placed = PlacedFrame;

// Points and pixels as OpenCV's solvers take them: the lens taken away, coordinates relative to the points' middle.
struct Correspondences {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  cv::Matx33d K;
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> pixels;  // K's principal point and these share one origin, so no conversion is due
  std::vector<std::size_t> source;  // position in what was seen
};

Correspondences Prepare(const std::vector<std::pair<std::int32_t, Eigen::Vector2d>>& seen,
                        const std::vector<Point>& points, const Camera& camera) {
  Correspondences c;
  const Eigen::Matrix3d K = camera.K();
  c.K = cv::Matx33d(K(0, 0), K(0, 1), K(0, 2), K(1, 0), K(1, 1), K(1, 2), K(2, 0), K(2, 1), K(2, 2));
  for (const auto& [point, x] : seen)
    c.middle += points[static_cast<std::size_t>(point)].x_in_world / static_cast<double>(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto n = camera.Normalized(seen[i].second);
    if (!n) continue;
    const Eigen::Vector3d X = points[static_cast<std::size_t>(seen[i].first)].x_in_world - c.middle;
    const Eigen::Vector2d x = (K * n->homogeneous()).head<2>();
    c.world.emplace_back(X.x(), X.y(), X.z());
    c.pixels.emplace_back(x.x(), x.y());
    c.source.push_back(i);
  }
  return c;
}

// Which correspondences a pose agrees with.
std::vector<int> Agreeing(const Correspondences& c, const cv::Vec3d& rotation, const cv::Vec3d& translation) {
  cv::Matx33d R;
  cv::Rodrigues(rotation, R);
  std::vector<int> agreeing;
  for (std::size_t i = 0; i < c.world.size(); ++i) {
    const cv::Vec3d X = R * cv::Vec3d(c.world[i].x, c.world[i].y, c.world[i].z) + translation;
    if (!(X[2] > 0)) continue;
    const cv::Vec3d x = c.K * X;
    if (std::hypot(x[0] / x[2] - c.pixels[i].x, x[1] / x[2] - c.pixels[i].y) <= kMaxErrorPx)
      agreeing.push_back(static_cast<int>(i));
  }
  return agreeing;
}

// Levenberg-Marquardt over the points that agree, twice: the second round takes in those that the first brought near.
Placed Polish(const std::vector<std::pair<std::int32_t, Eigen::Vector2d>>& seen, const Correspondences& c,
              cv::Vec3d rotation, cv::Vec3d translation) {
  constexpr int kRounds = 2;
  Placed placed;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<int> agreeing = Agreeing(c, rotation, translation);
    placed.inliers = static_cast<int>(agreeing.size());
    if (placed.inliers < kMinInliers) return placed;
    std::vector<cv::Point3d> world;
    std::vector<cv::Point2d> pixels;
    for (const int i : agreeing) {
      world.push_back(c.world[static_cast<std::size_t>(i)]);
      pixels.push_back(c.pixels[static_cast<std::size_t>(i)]);
    }
    cv::solvePnPRefineLM(world, pixels, c.K, cv::noArray(), rotation, translation);
  }
  const Eigen::Vector3d r(rotation[0], rotation[1], rotation[2]), t(translation[0], translation[1], translation[2]);
  if (!r.allFinite() || !t.allFinite()) return placed;
  const std::vector<int> agreeing = Agreeing(c, rotation, translation);
  placed.inliers = static_cast<int>(agreeing.size());
  if (placed.inliers < kMinInliers) return placed;
  const double angle = r.norm();
  placed.cam_from_world.rotation =
      angle > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, r / angle)) : Eigen::Quaterniond::Identity();
  placed.cam_from_world.translation = t - placed.cam_from_world.rotation * c.middle;
  for (const int i : agreeing) placed.observations.push_back(seen[c.source[static_cast<std::size_t>(i)]]);
  placed.ok = true;
  return placed;
}

// Pose from points and their pixels under a lens that is known: RANSAC over P3P, then least squares.
Placed Resection(const std::vector<std::pair<std::int32_t, Eigen::Vector2d>>& seen, const std::vector<Point>& points,
                 const Camera& camera) {
  const Correspondences c = Prepare(seen, points, camera);
  Placed placed;
  placed.inliers = static_cast<int>(c.world.size());
  if (placed.inliers < kMinInliers) return placed;
  cv::Vec3d rotation, translation;
  std::vector<int> inliers;
  if (!cv::solvePnPRansac(c.world, c.pixels, c.K, cv::noArray(), rotation, translation, false, kRansacRounds,
                          static_cast<float>(kMaxErrorPx), kRansacConfidence, inliers, cv::SOLVEPNP_P3P)) {
    placed.inliers = 0;
    return placed;
  }
  return Polish(seen, c, rotation, translation);
}

// Pose near a given one.
Placed Refine(const std::vector<std::pair<std::int32_t, Eigen::Vector2d>>& seen, const std::vector<Point>& points,
              const Camera& camera, const Rigid3& start) {
  const Correspondences c = Prepare(seen, points, camera);
  const Eigen::AngleAxisd turn(start.rotation);
  const Eigen::Vector3d r = turn.angle() * turn.axis(), t = start * c.middle;
  return Polish(seen, c, cv::Vec3d(r.x(), r.y(), r.z()), cv::Vec3d(t.x(), t.y(), t.z()));
}

// Fixes what RANSAC took for another pose: far things under a long lens look nearly alike from two places. A frame's
// neighbours in time are near in space, so their poses are tried as starts; the one that more points agree with stays,
// and among equals (kTie) the one nearer to where the neighbours say.
void Smooth(std::vector<Placed>& placed, const Sightings& seen, const std::vector<Point>& points,
            const Camera& camera) {
  constexpr double kTie = 0.9;
  std::vector<Placed> smoothed = placed;
  ParallelEach(placed.size(), 4, [&](std::size_t f) {
    std::vector<const Placed*> neighbours;
    for (const std::size_t distance : {1, 2, 3}) {
      if (f >= distance && placed[f - distance].ok) neighbours.push_back(&placed[f - distance]);
      if (f + distance < placed.size() && placed[f + distance].ok) neighbours.push_back(&placed[f + distance]);
    }
    if (neighbours.size() < 2) return;
    // The middle of the neighbours, coordinate by coordinate: one of them may be wrong itself.
    Eigen::Vector3d middle;
    for (int c = 0; c < 3; ++c) {
      std::vector<double> values;
      for (const Placed* n : neighbours) values.push_back(n->cam_from_world.OriginInSource()[c]);
      middle[c] = Median(std::move(values));
    }
    const auto distance_of = [&](const Placed& p) { return (p.cam_from_world.OriginInSource() - middle).norm(); };
    for (const Placed* n : neighbours) {
      const Placed other = Refine(seen[f], points, camera, n->cam_from_world);
      if (!other.ok) continue;
      const Placed& now = smoothed[f];
      const bool as_good = static_cast<double>(other.inliers) >= kTie * now.inliers;
      if (!now.ok || static_cast<double>(now.inliers) < kTie * other.inliers ||
          (as_good && distance_of(other) < distance_of(now)))
        smoothed[f] = other;
    }
  });
  placed = std::move(smoothed);
}

// Cameras of all frames from what they see of the points.
std::vector<Placed> PlaceFrames(const Sightings& seen, const std::vector<Point>& points, const Camera& camera,
                                ProgressSink& sink) {
  std::vector<Placed> placed(seen.size());
  Progress progress(sink, "placing all frames", static_cast<long>(seen.size()));
  ParallelEach(seen.size(), 1, [&](std::size_t f) {
    placed[f] = Resection(seen[f], points, camera);
    progress.Step();
  });
  Smooth(placed, seen, points, camera);
  return placed;
}

// The keyframes nearest in time to a frame.
std::vector<std::string> NearKeyframes(const std::vector<std::string>& keyframes, const std::string& frame) {
  const auto at = std::ranges::lower_bound(keyframes, frame);
  const auto before = std::min<std::size_t>(kNeighbours, static_cast<std::size_t>(at - keyframes.begin()));
  const auto after = std::min<std::size_t>(kNeighbours, static_cast<std::size_t>(keyframes.end() - at));
  return {at - static_cast<std::ptrdiff_t>(before), at + static_cast<std::ptrdiff_t>(after)};
}

Descriptors UnitDescriptors(const ColmapDatabase& db, std::int64_t image) {
  const Descriptors d = db.Descriptors(image).cast<float>();
  return d.rowwise().normalized();
}

// A database of its own, grown from the keyframes' one: that one stays what a rerun compares with. With features of all
// `frames`.
fs::path DatabaseOfAll(const std::vector<std::string>& frames, const Capture& all_frames,
                       const Features& keyframe_features, const ColmapJob& job) {
  const auto& [options, work_folder, colmap, sink] = job;
  const fs::path database = work_folder / "all_frames.db", key_file = work_folder / "all_frames.key";
  const std::string key =
      Fingerprint(work_folder / "features.json") + " " + Fingerprint(work_folder / "keyframes.json");
  std::error_code ec;
  if (!fs::exists(key_file, ec) || ReadText(key_file) != key || !ColmapDatabase::IsDatabase(database)) {
    for (const char* suffix : {"", "-journal", "-wal", "-shm"}) fs::remove(database.string() + suffix, ec);
    WriteFileAtomically(database, [&](const fs::path& t) {
      fs::copy_file(keyframe_features.database, t, fs::copy_options::overwrite_existing);
    });
    WriteTextAtomically(key_file, key);
  }
  const FeatureLimits limits = LimitsFor(options, all_frames.photos.size());
  const fs::path list = work_folder / "all_frames.txt";
  std::string names;
  for (const auto& frame : frames) names += frame + "\n";
  WriteTextAtomically(list, names);
  if (frames.empty()) return database;
  // Their descriptors are compared with the keyframes': by the same program.
  if (keyframe_features.own) {
    const std::set<std::string> wanted(frames.begin(), frames.end());
    PhotosToSearch search;
    search.folder = all_frames.folder;
    search.cameras.shared = true;
    search.limits = limits;
    search.task = "features of all frames";
    for (const InputPhoto& photo : all_frames.photos)
      if (wanted.count(photo.name)) search.photos.push_back(photo);
    if (FindOwnFeatures(search, database, job)) return database;
  }
  const std::vector<ColmapOption> extract = {
      {"database_path", database.string()},
      {"image_path", all_frames.folder.string()},
      {"image_list_path", list.string()},
      {"ImageReader.single_camera", "1"},
      {"SiftExtraction.use_gpu", colmap.has_cuda() ? "1" : "0"},
      {"SiftExtraction.max_image_size", std::to_string(limits.max_image_size_px)},
      {"SiftExtraction.max_num_features", std::to_string(limits.max_features)},
      {"SiftExtraction.num_threads", options.threads > 0 ? std::to_string(options.threads) : "-1"}};
  colmap.Run("feature_extractor", extract, "features of all frames (COLMAP)", static_cast<long>(frames.size()));
  return database;
}

// The point that each keypoint of a keyframe is, or -1: observations lie exactly at keypoints.
std::vector<std::int32_t> PointOfKeypoint(const KeyframePoints& points, const std::vector<Eigen::Vector2d>& keypoints) {
  std::vector<std::int32_t> all;
  for (const auto& x : keypoints) {
    const auto it = points.find({x.x(), x.y()});
    all.push_back(it == points.end() ? -1 : it->second);
  }
  return all;
}

struct FrameSightings {
  Sightings seen;
  std::vector<int> features;
};

// Points of the near keyframes in each frame. Matched here: COLMAP's matcher takes a quarter of a second a pair without
// a GPU, and then verifies what a pose is found from anyway.
FrameSightings FindSightings(const Scene& scene, const std::vector<std::string>& frames, const fs::path& database,
                             ProgressSink& sink) {
  const ColmapDatabase db(database);
  std::map<std::string, DatabaseImage> image_of;
  for (const auto& image : db.Images()) image_of[image.name] = image;
  std::map<std::string, KeyframePoints> points_of;
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    for (const Observation& o : scene.points[p].track)
      points_of[scene.views[static_cast<std::size_t>(o.view.value)].name][{o.x_px.x(), o.x_px.y()}] =
          static_cast<std::int32_t>(p);
  std::vector<std::string> keyframes;
  for (const View& view : scene.views) keyframes.push_back(view.name);
  std::map<std::string, std::vector<std::int32_t>> point_of_keypoint;
  std::map<std::string, Descriptors> descriptors_of;
  for (const auto& keyframe : keyframes)
    if (const auto image = image_of.find(keyframe); image != image_of.end()) {
      point_of_keypoint[keyframe] = PointOfKeypoint(points_of[keyframe], db.Keypoints(image->second.id));
      descriptors_of[keyframe] = UnitDescriptors(db, image->second.id);
    }
  FrameSightings found{Sightings(frames.size()), std::vector<int>(frames.size(), 0)};
  std::mutex reading;
  Progress matching(sink, "matching all frames", static_cast<long>(frames.size()));
  ParallelEach(frames.size(), 1, [&](std::size_t f) {
    matching.Step();
    const auto image = image_of.find(frames[f]);
    if (image == image_of.end()) return;
    found.features[f] = image->second.keypoints;
    std::vector<Eigen::Vector2d> keypoints;
    Descriptors descriptors;
    {
      const std::lock_guard lock(reading);
      keypoints = db.Keypoints(image->second.id);
      descriptors = UnitDescriptors(db, image->second.id);
    }
    if (static_cast<Eigen::Index>(keypoints.size()) != descriptors.rows()) return;
    std::set<std::pair<std::int32_t, int>> unique;
    for (const auto& keyframe : NearKeyframes(keyframes, frames[f])) {
      const auto of_keyframe = descriptors_of.find(keyframe);
      if (of_keyframe == descriptors_of.end()) continue;
      const auto& of_keypoint = point_of_keypoint.at(keyframe);
      constexpr auto kAll = std::numeric_limits<Eigen::Index>::max();
      for (const DescriptorMatch& m : MatchDescriptors(descriptors, of_keyframe->second, kMatchRatio, kAll)) {
        if (m.similarity < kLeastSimilarity || static_cast<std::size_t>(m.b) >= of_keypoint.size()) continue;
        const std::int32_t point = of_keypoint[static_cast<std::size_t>(m.b)];
        if (point >= 0 && unique.emplace(point, m.a).second)
          found.seen[f].emplace_back(point, keypoints[static_cast<std::size_t>(m.a)]);
      }
    }
  });
  return found;
}

// Views are sorted by name; the observations follow.
void SortViews(Scene& scene) {
  const std::vector<View> views = std::move(scene.views);
  std::vector<std::size_t> order(views.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return views[a].name < views[b].name; });
  std::vector<std::int32_t> new_index(views.size());
  scene.views.clear();
  for (std::size_t i = 0; i < order.size(); ++i) {
    new_index[order[i]] = static_cast<std::int32_t>(i);
    scene.views.push_back(views[order[i]]);
  }
  for (Point& point : scene.points)
    for (Observation& o : point.track) o.view.value = new_index[static_cast<std::size_t>(o.view.value)];
}

}  // namespace

void RegisterAllFrames(Scene& scene, const Capture& all_frames, const Features& keyframe_features, bool lens_known,
                       const ColmapJob& job, std::vector<MissingPhoto>& missing) {
  std::set<std::string> known, explained;
  for (const View& view : scene.views) known.insert(view.name);
  for (const auto& m : missing) explained.insert(m.name);
  std::vector<std::string> frames;
  for (const InputPhoto& photo : all_frames.photos)
    if (!known.count(photo.name)) frames.push_back(photo.name);
  auto [seen, features] =
      FindSightings(scene, frames, DatabaseOfAll(frames, all_frames, keyframe_features, job), job.sink);

  // All frames of a video share the keyframes' camera.
  const CameraId camera_id = scene.views.front().camera;
  std::vector<Placed> placed = PlaceFrames(seen, scene.points, scene.CameraOf(scene.views.front()), job.sink);
  AdjustWithFrames(scene, placed, lens_known, job);
  for (auto& of_frame : seen)
    std::erase_if(of_frame,
                  [&](const auto& s) { return scene.points[static_cast<std::size_t>(s.first)].track.empty(); });
  placed = PlaceFrames(seen, scene.points, scene.CameraOf(scene.views.front()), job.sink);

  for (std::size_t f = 0; f < frames.size(); ++f) {
    if (!placed[f].ok) {
      if (!explained.count(frames[f]))
        missing.push_back(
            {frames[f],
             features[f] == 0
                 ? std::string("blurred or textureless (no features)")
                 : fmt::format("too few points of the keyframes in it ({} agree, {} are needed; {} features)",
                               placed[f].inliers, kMinInliers, features[f]),
             "film more slowly there, or ask for more --keyframes"});
      continue;
    }
    std::erase_if(missing, [&](const MissingPhoto& m) { return m.name == frames[f]; });
    View view;
    view.name = frames[f];
    view.camera = camera_id;
    view.cam_from_world = placed[f].cam_from_world;
    const auto index = static_cast<std::int32_t>(scene.views.size());
    std::set<std::int32_t> once;
    for (const auto& [point, x] : placed[f].observations)
      if (once.insert(point).second) scene.points[static_cast<std::size_t>(point)].track.push_back({ViewId{index}, x});
    scene.views.push_back(std::move(view));
  }
  SortViews(scene);
  std::erase_if(scene.points, [](const Point& point) { return point.track.empty(); });
  scene.image_folder = all_frames.folder;
  std::ranges::sort(missing, [](const auto& a, const auto& b) { return a.name < b.name; });
}

}  // namespace lumi
