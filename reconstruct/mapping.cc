#include "reconstruct/mapping.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "reconstruct/colmap_database.h"
#include "reconstruct/groups.h"
#include "reconstruct/merge_models.h"
#include "reconstruct/reprojection.h"
#include "reconstruct/standing.h"
#include "reconstruct/thin_matches.h"
#include "scene/files/colmap_model.h"
#include "scene/geometry/angle.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// Two unrelated photos still give COLMAP a "model" of its 15 to 40 chance inliers; two photos of one thing give
// hundreds.
constexpr std::size_t kMinPoints = 50;
// COLMAP keeps points of 1.5 degrees and more; a scene whose median lies at that bound has no depth to speak of.
constexpr double kMinMedianAngleDeg = 1.6;
// From so many photos on, two that COLMAP joined do not stand for the capture.
constexpr std::size_t kCaptureOfMany = 5;
constexpr std::size_t kTooFewOfMany = 2;
// The principal point is determined by many photos from different places only.
constexpr std::size_t kPhotosForPrincipalPoint = 6;
// Lenses are centred: a principal point further from the photo's middle (as a fraction of its diagonal) is a fit to
// something else.
constexpr double kMaxPrincipalPointShift = 0.05;
// A group that was moved as a whole is still some pixels off, and so are the points that tie it: these are kept at
// first.
constexpr double kOutlierFactorOfMoved = 20;

// Least squares may raise the mean error a little while it lowers the mean square; not by more than this.
constexpr double kWorse = 1.02;

// The last adjustment stops where a step lowers the cost by less than this share: COLMAP's default of 0 takes all
// iterations, five times as many, for the same cameras to 1e-4 of a degree.
constexpr const char* kPolishTolerance = "1e-8";

// While cameras are placed, adjustments stop earlier: others follow. All cameras are adjusted when there are a fifth
// more of them or of points (COLMAP: a tenth); small models on several cores, too (COLMAP: from 50,000 residuals on).
// Half of the time, and after polishing the same cameras within their own scatter.
constexpr const char* kMappingTolerance = "1e-6";
constexpr const char* kGrowthBetweenAdjustments = "1.2";
constexpr const char* kResidualsForThreads = "5000";
const std::vector<ColmapOption> kEndEarly = {{"Mapper.ba_local_function_tolerance", kMappingTolerance, false},
                                             {"Mapper.ba_global_function_tolerance", kMappingTolerance, false},
                                             {"Mapper.ba_global_images_ratio", kGrowthBetweenAdjustments, false},
                                             {"Mapper.ba_global_points_ratio", kGrowthBetweenAdjustments, false}};

// Photos of a part that the hierarchical mapper places by itself; by default one part may hold 500.
constexpr const char* kPhotosOfAPart = "100";

// A scene with less than this share of the photos is tried once more, with bounds for photos that are close together.
constexpr double kPoorFraction = 0.5;
constexpr const char* kMildInitialAngleDeg = "6";
constexpr const char* kMildInitialInliers = "50";
constexpr const char* kMildPoseInliers = "20";

// From so many photos on they are placed by few matches (thin_matches.h).
constexpr std::size_t kPhotosToThin = 60;

struct Part {
  fs::path folder;
  Scene scene;
};

// A model that COLMAP left. One that cannot be read is no fault of the photos.
Scene ReadLeftModel(const fs::path& folder) {
  try {
    return ReadColmapModel(folder);
  } catch (const Error& e) {
    if (e.code() == ExitCode::kMachine) throw;
    throw MachineError(fmt::format("COLMAP left a model that cannot be read: {}", e.what()),
                       "is the disk full? A second run goes on from here", e.file());
  }
}

std::vector<Part> ReadParts(const fs::path& sparse) {
  std::vector<Part> parts;
  std::error_code ec;
  for (const auto& entry : fs::directory_iterator(sparse, ec)) {
    if (!entry.is_directory()) continue;
    Part part{entry.path(), ReadLeftModel(entry.path())};
    if (!part.scene.views.empty()) parts.push_back(std::move(part));
  }
  std::ranges::sort(parts, [](const Part& a, const Part& b) {
    return std::pair(a.scene.views.size(), a.scene.points.size()) >
           std::pair(b.scene.views.size(), b.scene.points.size());
  });
  return parts;
}

// Parts that have enough in common become one, the largest first.
void MergeParts(std::vector<Part>& parts, const ColmapDatabase& database, ProgressSink& sink) {
  std::map<std::string, std::int64_t> camera_of;
  for (const DatabaseImage& image : database.Images()) camera_of[image.name] = image.camera_id;
  const auto same_camera = [&](const std::string& a, const std::string& b) {
    const auto of_a = camera_of.find(a), of_b = camera_of.find(b);
    return of_a != camera_of.end() && of_b != camera_of.end() && of_a->second == of_b->second;
  };
  const auto matches_of = [&](const Scene& joint) { return VerifiedMatchesOf(joint, database); };
  for (std::size_t i = 1; i < parts.size();) {
    Scene &into = parts.front().scene, &from = parts[i].scene;
    const bool adds = !std::ranges::all_of(from.views, [&](const View& view) {
      return std::ranges::binary_search(into.views, view.name, {}, &View::name);
    });
    if (!adds) {
      parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(i));
      continue;
    }
    auto merged = MergeModels(into, from, matches_of, same_camera);
    if (!merged) {
      ++i;
      continue;
    }
    sink.Message(
        fmt::format("two parts of {} and {} photos that COLMAP did not join have {} photos and {} points in "
                    "common: they are one now, of {}",
                    into.views.size(), from.views.size(), merged->tie.common_photos, merged->tie.common_points,
                    merged->scene.views.size()));
    into = std::move(merged->scene);
    parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(i));
    i = 1;
  }
}

std::string ShootHint(std::size_t photos) {
  return photos <= 2 ? "photos of one thing from places a few steps apart are needed; three or more are better"
                     : "shoot so that each photo shows two thirds of the last one, sharp, from a new place; if the "
                       "cameras are known already, give them with --poses";
}

// The hierarchical mapper knows no list of photos: it takes all of the database.
bool HoldsOnly(const Capture& capture, const fs::path& database, ProgressSink& sink) {
  std::set<std::string> names;
  for (const InputPhoto& photo : capture.photos) names.insert(photo.name);
  const bool only = std::ranges::all_of(ColmapDatabase(database).Images(),
                                        [&](const DatabaseImage& image) { return names.contains(image.name); });
  if (!only) sink.Message("the database has photos that are not here: placed by the incremental mapper");
  return only;
}

std::vector<ColmapOption> MapperOptions(const Capture& capture, const CameraPlan& cameras, const fs::path& database,
                                        const fs::path& output, const ColmapJob& job) {
  const ReconstructOptions& options = job.options;
  const std::string refine = cameras.known ? "0" : "1";
  std::vector<ColmapOption> arguments = {
      {"database_path", database.string()},
      {"image_path", capture.folder.string()},
      {"output_path", output.string()},
      {"image_list_path", (job.work_folder / kPhotoList).string(), false},
      {"Mapper.ba_refine_focal_length", refine},
      {"Mapper.ba_refine_principal_point", "0"},
      {"Mapper.ba_refine_extra_params", refine},
      {"Mapper.min_model_size", "3"},
      {"Mapper.max_num_models", "10"},
      {"Mapper.num_threads", options.threads > 0 ? std::to_string(options.threads) : "-1"},
      {"Mapper.ba_min_num_residuals_for_multi_threading", kResidualsForThreads, false},
      {"random_seed", std::to_string(options.seed), false}};
  if (options.mapper != Mapper::kCareful) arguments.insert(arguments.end(), kEndEarly.begin(), kEndEarly.end());
  return arguments;
}

fs::path EmptyFolder(const fs::path& folder) {
  std::error_code ec;
  fs::remove_all(folder, ec);
  fs::create_directories(folder);
  return folder;
}

struct Placed {
  std::vector<Part> parts;  // the largest first
  int exit_code = 0;
};

// By the mapper that is asked for, into work_folder/sparse.
Placed RunMapper(const Capture& capture, const CameraPlan& cameras, const fs::path& database, const ColmapJob& job) {
  const fs::path sparse = EmptyFolder(job.work_folder / "sparse");
  std::vector<ColmapOption> arguments = MapperOptions(capture, cameras, database, sparse, job);
  const auto n = static_cast<long>(capture.photos.size());
  Placed placed;
  if (job.options.mapper == Mapper::kHierarchical && HoldsOnly(capture, database, job.sink)) {
    std::erase_if(arguments, [](const ColmapOption& o) { return o.name == "image_list_path"; });
    arguments.push_back({"leaf_max_num_images", kPhotosOfAPart});
    if (job.options.threads > 0) arguments.push_back({"num_workers", std::to_string(job.options.threads)});
    placed.exit_code = job.colmap.Run("hierarchical_mapper", arguments, "placing cameras part by part (COLMAP)", n);
  } else {
    placed.exit_code = job.colmap.Run("mapper", arguments, "placing cameras (COLMAP)", n);
  }
  placed.parts = ReadParts(sparse);
  std::error_code error;
  if (placed.exit_code == 0 && fs::is_empty(sparse, error))  // where it places nothing, it ends with an error
    throw MachineError("COLMAP's mapper ended well and wrote no model", "see the log", job.colmap.log_file());
  return placed;
}

bool Trusted(const std::vector<Part>& parts) { return !parts.empty() && Distrust(parts.front().scene).empty(); }

// Whether a scene is there with a good part of the photos.
bool Good(const std::vector<Part>& parts, std::size_t photos) {
  return Trusted(parts) &&
         static_cast<double>(parts.front().scene.views.size()) >= kPoorFraction * static_cast<double>(photos);
}

// What COLMAP made of a part, in the part's place.
Part Replaced(const Part& part, const fs::path& made, Scene scene) {
  fs::remove_all(part.folder);
  fs::rename(made, part.folder);
  return {part.folder, std::move(scene)};
}

// The part with its points triangulated from all matches, its cameras as they are.
Part WithAllMatches(const Part& part, const Capture& capture, const fs::path& database, const ColmapJob& job) {
  const fs::path made = EmptyFolder(job.work_folder / "sparse-all");
  job.colmap.Run("point_triangulator",
                 {{"database_path", database.string()},
                  {"image_path", capture.folder.string()},
                  {"input_path", part.folder.string()},
                  {"output_path", made.string()},
                  {"clear_points", "1", false},
                  {"Mapper.ba_refine_focal_length", "0"},
                  {"Mapper.ba_refine_principal_point", "0"},
                  {"Mapper.ba_refine_extra_params", "0"},
                  {"Mapper.num_threads", job.options.threads > 0 ? std::to_string(job.options.threads) : "-1"},
                  {"Mapper.ba_global_max_refinements", "1", false},
                  {"Mapper.ba_global_function_tolerance", kMappingTolerance, false}},
                 "triangulating from all matches (COLMAP)", static_cast<long>(part.scene.views.size()));
  if (!FindColmapModel(made)) return part;
  Scene scene = ReadLeftModel(made);
  const bool whole = scene.views.size() == part.scene.views.size() && scene.points.size() >= part.scene.points.size();
  return whole ? Replaced(part, made, std::move(scene)) : part;
}

// What few matches did not place may be placed by all of them.
Part WithMorePhotos(const Part& part, const Capture& capture, const CameraPlan& cameras, const fs::path& database,
                    const ColmapJob& job) {
  const fs::path made = EmptyFolder(job.work_folder / "sparse-more");
  std::vector<ColmapOption> arguments = MapperOptions(capture, cameras, database, made, job);
  arguments.push_back({"input_path", part.folder.string()});
  job.colmap.Run("mapper", arguments, "placing the remaining cameras (COLMAP)",
                 static_cast<long>(capture.photos.size()));
  if (!FindColmapModel(made)) return part;
  Scene scene = ReadLeftModel(made);
  return scene.views.size() > part.scene.views.size() ? Replaced(part, made, std::move(scene)) : part;
}

// Cameras placed by few matches, points of all. No parts where the capture is small, has few matches anyway, or is not
// held together by them.
std::vector<Part> PlaceByFewMatches(const Capture& capture, const CameraPlan& cameras, const Features& features,
                                    const ColmapJob& job) {
  if (job.options.mapper == Mapper::kCareful || capture.photos.size() < kPhotosToThin) return {};
  const fs::path folder = EmptyFolder(job.work_folder / "thinned");
  Placed placed;
  if (const fs::path thinned = folder / "database.db"; WriteThinnedDatabase(features.database, thinned))
    placed = RunMapper(capture, cameras, thinned, job);
  std::error_code ec;
  fs::remove_all(folder, ec);
  if (!Good(placed.parts, capture.photos.size())) return {};
  for (Part& part : placed.parts) part = WithAllMatches(part, capture, features.database, job);
  Part& largest = placed.parts.front();
  if (largest.scene.views.size() < capture.photos.size())
    largest = WithMorePhotos(largest, capture, cameras, features.database, job);
  return std::move(placed.parts);
}

// The parts that COLMAP's mapper finds, the largest first; never none.
std::vector<Part> PlacePhotos(const Capture& capture, const CameraPlan& cameras, const Features& features,
                              const ColmapJob& job) {
  const auto n = capture.photos.size();
  if (std::vector<Part> parts = PlaceByFewMatches(capture, cameras, features, job); !parts.empty()) return parts;
  Placed placed = RunMapper(capture, cameras, features.database, job);
  if (!Good(placed.parts, n)) {
    // Photos taken close to each other: where no pair reaches COLMAP's 16 degrees and 100 points to begin with, it
    // begins with a bad one. Once more with milder bounds; the larger scene stays.
    const fs::path second = EmptyFolder(job.work_folder / "sparse-mild");
    std::vector<ColmapOption> mild = MapperOptions(capture, cameras, features.database, second, job);
    mild.push_back({"Mapper.init_min_tri_angle", kMildInitialAngleDeg});
    mild.push_back({"Mapper.init_min_num_inliers", kMildInitialInliers});
    mild.push_back({"Mapper.abs_pose_min_num_inliers", kMildPoseInliers});
    const int rc =
        job.colmap.Run("mapper", mild, "placing cameras that are close together (COLMAP)", static_cast<long>(n));
    std::vector<Part> others = ReadParts(second);
    if (Trusted(others) &&
        (!Trusted(placed.parts) || others.front().scene.views.size() > placed.parts.front().scene.views.size()))
      placed = {std::move(others), rc};
  }
  if (placed.parts.empty())
    throw DataError(fmt::format("COLMAP found no two of the {} photos that show one thing from different places{}", n,
                                placed.exit_code == 0 ? ""
                                                      : fmt::format(" (it ended with {}: {})", placed.exit_code,
                                                                    job.colmap.LastComplaint())),
                    ShootHint(n));
  return std::move(placed.parts);
}

// Cameras of groups that nothing verifies, to the front.
void NameGroups(const std::vector<HangingGroup>& groups, std::vector<CameraStanding>& standings) {
  for (const HangingGroup& group : groups)
    for (CameraStanding& s : standings)
      if (std::ranges::find(group.photos, s.name) != group.photos.end()) {
        s.placed_anew = s.placed_anew || group.moved;
        if (!group.moved && s.remark.empty())
          s.remark = fmt::format("tied to the other photos, with {} more, by {} points only", group.photos.size() - 1,
                                 group.points);
      }
  std::ranges::stable_sort(standings, {}, [](const CameraStanding& s) { return s.remark.empty(); });
}

bool PrincipalPointsPlausible(const Scene& scene) {
  return std::ranges::all_of(scene.cameras, [](const Camera& camera) {
    const Eigen::Vector2d middle(camera.width_px / 2.0, camera.height_px / 2.0);
    return (camera.PrincipalPointPx() - middle).norm() <=
           kMaxPrincipalPointShift * std::hypot(camera.width_px, camera.height_px);
  });
}

}  // namespace

Scene WithoutOutliers(const Scene& scene, double factor) {
  std::vector<double> errors;
  for (const Point& point : scene.points) errors.push_back(point.error_px);
  if (errors.size() < 3) return scene;
  const double limit = factor * Median(std::move(errors));
  Scene clean = scene;
  std::erase_if(clean.points, [&](const Point& point) { return point.error_px > limit; });
  return clean;
}

Scene PolishCameras(const Scene& scene, bool lens_known, int most_iterations, const ColmapJob& job,
                    double outlier_factor) {
  const auto& [options, work_folder, colmap, sink] = job;
  Scene clean = WithoutOutliers(scene, outlier_factor);
  const double error_before_px = UpdatePointErrors(clean);
  std::vector<std::size_t> photos(scene.cameras.size(), 0);
  for (const View& view : scene.views) ++photos[static_cast<std::size_t>(view.camera.value)];
  const bool free_principal_point =
      !lens_known && std::ranges::all_of(photos, [](std::size_t n) { return n == 0 || n >= kPhotosForPrincipalPoint; });

  const fs::path in = work_folder / "polish-in", out = work_folder / "polish-out";
  const auto adjust = [&](bool principal_point) -> std::optional<Scene> {
    std::error_code ec;
    fs::remove_all(in, ec);
    fs::remove_all(out, ec);
    fs::create_directories(out);
    WriteColmapModel(clean, in);
    const std::string refine = lens_known ? "0" : "1";
    colmap.Run("bundle_adjuster",
               {{"input_path", in.string()},
                {"output_path", out.string()},
                {"BundleAdjustment.max_num_iterations", std::to_string(most_iterations)},
                {"BundleAdjustment.function_tolerance", kPolishTolerance, false},
                {"BundleAdjustment.refine_focal_length", refine},
                {"BundleAdjustment.refine_extra_params", refine},
                {"BundleAdjustment.refine_principal_point", principal_point ? "1" : "0"}},
               "polishing the cameras (COLMAP)", 0);
    if (!FindColmapModel(out)) return std::nullopt;
    Scene adjusted = ReadLeftModel(out);
    fs::remove_all(in, ec);
    fs::remove_all(out, ec);
    // An adjustment may only improve what it started from.
    if (adjusted.views.size() != clean.views.size() || adjusted.points.size() < clean.points.size() / 2 ||
        !(UpdatePointErrors(adjusted) <= kWorse * error_before_px))
      return std::nullopt;
    for (const Camera& camera : adjusted.cameras)
      if (Validate(camera)) return std::nullopt;
    if (principal_point && !PrincipalPointsPlausible(adjusted)) return std::nullopt;
    return adjusted;
  };
  if (free_principal_point) {
    if (auto adjusted = adjust(true)) return *adjusted;
    sink.Message("the principal point is not determined by these photos; it stays in the middle");
  }
  if (auto adjusted = adjust(false)) return *adjusted;
  return scene;
}

std::string Distrust(const Scene& scene) {
  if (scene.points.size() < kMinPoints)
    return fmt::format("only {} points are seen by more than one photo: a chance alignment", scene.points.size());
  std::vector<double> angles;
  for (const Point& point : scene.points) {
    double widest = 0;
    for (std::size_t i = 1; i < point.track.size(); ++i) {
      const auto ray = [&](const Observation& o) -> Eigen::Vector3d {
        return scene.views[static_cast<std::size_t>(o.view.value)].CentreInWorld() - point.x_in_world;
      };
      widest = std::max(widest, AngleBetween(ray(point.track[0]), ray(point.track[i])));
    }
    angles.push_back(widest);
  }
  const double usual_deg = Median(std::move(angles)) * kDegPerRad;
  if (usual_deg < kMinMedianAngleDeg)
    return fmt::format("the photos were taken from nearly one place (rays meet at {:.2f} degrees)", usual_deg);
  return {};
}

StandingCameras KeepCamerasThatStand(Scene& scene, const CameraPlan& cameras, const Features& features,
                                     const ColmapJob& job) {
  const ColmapDatabase database(features.database);
  const std::vector<ViewMatches> matches = VerifiedMatchesOf(scene, database);
  VerifiedGroups joined = VerifyGroups(scene, matches);
  for (const HangingGroup& group : joined.groups)
    job.sink.Message(group.moved
                         ? fmt::format("{} photos ({} ...) were placed together in a wrong place: they were moved "
                                       "as a whole to where their matches have them",
                                       group.photos.size(), group.photos.front())
                         : fmt::format("{} photos ({} ...) are tied to the others by {} points only",
                                       group.photos.size(), group.photos.front(), group.points));
  VerifiedCameras verified = VerifyCameras(std::move(joined.scene), matches);
  StandingCameras standing{std::move(verified.standings), std::move(verified.left_out)};
  if (!joined.changed && !verified.changed) {
    NameGroups(joined.groups, standing.standings);
    return standing;
  }
  std::set<std::string> anew;
  for (const CameraStanding& s : standing.standings)
    if (s.placed_anew) anew.insert(s.name);
  if (verified.changed)
    job.sink.Message(
        fmt::format("{} of {} cameras did not stand where their points have them: {} placed anew, {} left out",
                    anew.size() + standing.left_out.size(), scene.views.size(), anew.size(), standing.left_out.size()));
  const fs::path folder = scene.image_folder;
  UpdatePointErrors(verified.scene);
  if (joined.changed) {
    verified.scene =
        PolishCameras(verified.scene, cameras.known.has_value(), kPolishIterations, job, kOutlierFactorOfMoved);
    UpdatePointErrors(verified.scene);
  }
  scene = PolishCameras(verified.scene, cameras.known.has_value(), kPolishIterations, job);
  scene.image_folder = folder;
  standing.standings = MeasureStandings(scene, VerifiedMatchesOf(scene, database));
  for (CameraStanding& s : standing.standings) s.placed_anew = anew.contains(s.name);
  NameGroups(joined.groups, standing.standings);
  return standing;
}

Mapping MapScene(const Capture& capture, const CameraPlan& cameras, const Features& features, const ColmapJob& job) {
  const auto& [options, work_folder, colmap, sink] = job;
  const auto n = capture.photos.size();
  StepClock clock;
  std::vector<Part> parts = PlacePhotos(capture, cameras, features, job);
  if (parts.size() > 1) MergeParts(parts, ColmapDatabase(features.database), sink);
  const auto wanted = static_cast<std::size_t>(options.component);
  if (wanted >= parts.size())
    throw DataError(fmt::format(
        "there is no component {}: COLMAP found {}", wanted,
        parts.size() == 1 ? "one, number 0" : fmt::format("{}, numbers 0 to {}", parts.size(), parts.size() - 1)));

  Mapping mapping;
  mapping.component = options.component;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    mapping.components.push_back(static_cast<int>(parts[i].scene.views.size()));
    if (i == wanted) continue;
    std::set<std::string> names;
    for (const View& view : parts[i].scene.views) names.insert(view.name);
    mapping.other_parts.push_back(std::move(names));
  }
  Scene chosen = parts[wanted].scene;
  UpdatePointErrors(chosen);
  const auto joined = chosen.views.size();
  if (n >= kCaptureOfMany && joined <= kTooFewOfMany)
    throw DataError(fmt::format("COLMAP joined only {} of {} photos", joined, n), ShootHint(n));
  if (const std::string distrust = Distrust(chosen); !distrust.empty())
    throw DataError(fmt::format("the photos do not fit together: {}", distrust), ShootHint(n));
  mapping.steps.push_back(clock.Lap("mapping"));
  mapping.scene = PolishCameras(chosen, cameras.known.has_value(), kPolishIterations, job);
  mapping.steps.push_back(clock.Lap("polishing"));
  mapping.scene.image_folder = capture.folder;
  return mapping;
}

}  // namespace lumi
