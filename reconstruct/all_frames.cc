#include "reconstruct/all_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <numeric>
#include <set>
#include <string>

#include "reconstruct/adjust_frames.h"
#include "reconstruct/colmap_database.h"
#include "reconstruct/own_features.h"
#include "reconstruct/place_camera.h"
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

using Sightings = std::vector<std::vector<Sighting>>;                      // of each frame
using KeyframePoints = std::map<std::pair<double, double>, std::int32_t>;  // keypoint -> point

using Placed = PlacedCamera;

// Corrects frames for which RANSAC took another pose: far things under a long lens look nearly alike from two places. A
// frame's neighbours in time are near in space, so their poses are tried as starts; the one that more points agree with
// stays, and among equals (kTie) the one nearer to where the neighbours say.
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
      const Placed other = PlaceCameraNear(seen[f], points, camera, n->cam_from_world);
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
    placed[f] = PlaceCamera(seen[f], points, camera);
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

// A database with features of all `frames`. It begins as a copy of the keyframes' database, which itself stays as it
// is, since a rerun compares with it.
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
  // Their descriptors are compared with the keyframes', so the same program must find them.
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

// Points of the near keyframes in each frame. Matched here, not by COLMAP: its matcher takes a quarter of a second a
// pair without a GPU, and then verifies each pair, which placing the camera does anyway.
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
                               placed[f].inliers, kMinPointsOfPose, features[f]),
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
