#include "reconstruct/features.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "reconstruct/colmap_database.h"
#include "reconstruct/given_camera.h"
#include "reconstruct/own_features.h"
#include "scene/files/atomic_file.h"
#include "scene/files/camera_yaml.h"
#include "scene/files/provenance.h"
#include "scene/program/error.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

// From so many photos on a shared camera's second radial term is well determined.
constexpr std::size_t kPhotosForRadial = 5;
// Exhaustive matching beyond this takes hours on a CPU.
constexpr std::size_t kMaxExhaustivePhotos = 100;
constexpr std::size_t kMaxExhaustiveKeyframes = 60;
// Beyond that each photo is matched with this many photos that look most like it (for a keyframe fewer, as its
// neighbours in time are matched too); then this many rounds add pairs that the matches found make likely.
constexpr int kSimilarPhotos = 40, kSimilarFrames = 10, kMoreRounds = 3;
// Neighbours in time that each keyframe is matched with; beyond them at distances 2, 4, 8 ... (quadratic overlap).
constexpr int kSequentialOverlap = 10;

std::string ParamsText(const Camera& camera) {
  std::string text;
  for (std::size_t i = 0; i < camera.params.size(); ++i)
    text += fmt::format("{}{:.17g}", i ? "," : "", camera.params[i]);
  return text;
}

// What the features in a database depend on: settings, and each photo's content.
struct FeatureSettings {
  int max_image_size_px = 0, max_features = 0;
  std::string masks;
  bool shared_camera = false;
  std::string camera_model, camera_params, database;
  std::string finder;  // "own", "colmap"
  bool operator==(const FeatureSettings&) const = default;
};
void ListKeys(JsonKeys& j, FeatureSettings& s) {
  j("max_image_size_px", s.max_image_size_px, "max_features", s.max_features, "masks", s.masks, "shared_camera",
    s.shared_camera);
  j("camera_model", s.camera_model, "camera_params", s.camera_params, "database", s.database, "finder", s.finder);
}
struct FeatureKey {
  FeatureSettings settings;
  std::map<std::string, std::string> photos;  // name, fingerprint
};
void ListKeys(JsonKeys& j, FeatureKey& k) { j("settings", k.settings, "photos", k.photos); }

FeatureKey KeyOf(const Capture& capture, const CameraPlan& cameras, const FeatureLimits& limits,
                 const ReconstructOptions& options, const fs::path& user_database, bool own) {
  FeatureKey key;
  key.settings = {limits.max_image_size_px,
                  limits.max_features,
                  options.masks.empty() ? "" : Fingerprint(options.masks),
                  cameras.shared,
                  std::string(Name(cameras.known ? cameras.known->model : cameras.model)),
                  cameras.known ? ParamsText(*cameras.known) : "",
                  user_database.empty() ? "" : Fingerprint(user_database),
                  own ? "own" : "colmap"};
  for (const InputPhoto& photo : capture.photos) key.photos[photo.name] = Fingerprint(capture.folder / photo.name);
  return key;
}

// Whether a database made under the key in `file` serves `key`: same settings, and no photo changed or gone.
bool Serves(const fs::path& file, const FeatureKey& key) {
  std::error_code ec;
  const auto json = fs::exists(file, ec) ? JsonKeys::Parse(ReadText(file)) : std::nullopt;
  FeatureKey old;
  if (!json || !json->Into(old) || !(old.settings == key.settings)) return false;
  return std::includes(key.photos.begin(), key.photos.end(), old.photos.begin(), old.photos.end());
}

void RemoveDatabase(const fs::path& database) {
  for (const char* suffix : {"", "-journal", "-wal", "-shm"}) {
    std::error_code ec;
    fs::remove(database.string() + suffix, ec);
  }
}

// COLMAP's database is on the disk when the system says so, which is later than COLMAP. After a restart of the machine,
// which may have come from a loss of power, it is checked before it is built on.
bool SurvivedRestart(const fs::path& work_folder, const fs::path& database, ProgressSink& sink) {
  if (!RestartedSince(work_folder) || ColmapDatabase(database).IsWhole()) return true;
  sink.Message("the machine was restarted while COLMAP's database was written, and it is damaged: it is made anew");
  return false;
}

std::size_t CountKnown(const fs::path& database, const std::set<std::string>& names,
                       ColmapDatabase::Access access = ColmapDatabase::Access::kOurs) {
  std::size_t known = 0;
  for (const auto& image : ColmapDatabase(database, access).Images()) known += names.count(image.name);
  return known;
}

// The user's own database: the one given, or one beside the photos that knows them.
fs::path UserDatabase(const Capture& capture, const ReconstructOptions& options, const std::set<std::string>& names) {
  if (!options.database.empty()) {
    if (CountKnown(options.database, names, ColmapDatabase::Access::kTheirs) == 0)
      throw InputError(options.database, "knows none of these photos",
                       "its image names must be paths relative to the folder of photos");
    return options.database;
  }
  if (capture.is_video || capture.resampled || !options.database_beside) return {};
  const fs::path beside = fs::absolute(options.input).lexically_normal() / ".." / "database.db";
  const fs::path path = beside.lexically_normal();
  constexpr auto kTheirs = ColmapDatabase::Access::kTheirs;
  if (ColmapDatabase::IsDatabase(path, kTheirs) && CountKnown(path, names, kTheirs) > 0) return path;
  return {};
}

// Photos of one size and lens setting share a camera where COLMAP gave each its own (same numbers from the same EXIF);
// split: those whose lens is unknown have each its own. False where nothing changed.
bool GroupCameras(const Capture& capture, const fs::path& database, bool split) {
  ColmapDatabase db(database);
  if (db.HasRigs()) return false;
  std::map<std::string, const InputPhoto*> photo_of;
  for (const InputPhoto& photo : capture.photos) photo_of[photo.name] = &photo;
  struct Group {
    const InputPhoto* photo;
    std::vector<std::int64_t> images;
  };
  std::map<std::tuple<int, int, double, std::string, std::int64_t>, Group> groups;
  std::set<std::int64_t> camera_ids;
  for (const auto& image : db.Images()) {
    const auto it = photo_of.find(image.name);
    if (it == photo_of.end()) return false;  // not ours
    camera_ids.insert(image.camera_id);
    const InputPhoto& photo = *it->second;
    Group& group = groups[{photo.width_px, photo.height_px, photo.focal_35mm.value_or(0), LensSetting(photo),
                           split && LensIsUnknown(photo) ? image.id : 0}];
    group.photo = &photo;
    group.images.push_back(image.id);
  }
  if (!split && camera_ids.size() <= groups.size()) return false;
  std::vector<Camera> cameras;
  std::map<std::int64_t, std::size_t> camera_of_image;
  for (const auto& [key, group] : groups) {
    for (const auto id : group.images) camera_of_image[id] = cameras.size();
    cameras.push_back(
        GuessCamera(group.images.size() >= kPhotosForRadial ? CameraModel::kRadial : CameraModel::kSimpleRadial,
                    group.photo->width_px, group.photo->height_px, group.photo->focal_35mm.value_or(0)));
  }
  db.SetCameras(cameras, false, camera_of_image);
  return true;
}

// COLMAP reads EXIF in JPEG files only, and none in the copies of HEIC, RAW or 16-bit photos: cameras that it guessed
// begin at the focal length that EXIF gives all their photos, and count as known as those that it read itself.
void TakeFocalLengths(const Capture& capture, const fs::path& database) {
  ColmapDatabase db(database);
  std::map<std::string, const InputPhoto*> photo_of;
  for (const InputPhoto& photo : capture.photos) photo_of[photo.name] = &photo;
  std::map<std::int64_t, std::set<double>> focals_of;
  for (const auto& image : db.Images()) {
    const auto it = photo_of.find(image.name);
    focals_of[image.camera_id].insert(it == photo_of.end() ? 0 : it->second->focal_35mm.value_or(0));
  }
  for (const DatabaseCamera& entry : db.Cameras()) {
    const std::set<double>& focals = focals_of[entry.id];
    if (entry.focal_is_known || focals.size() != 1 || !(*focals.begin() > 0)) continue;
    const Camera& camera = entry.camera;
    const double f = std::max(camera.width_px, camera.height_px) * *focals.begin() / kFilm35WidthMm;
    db.SetFocalLength(entry.id, camera.WithPinhole({f, f}, camera.PrincipalPointPx()));
  }
}

void SetKnownCamera(const Camera& camera, const fs::path& database) {
  ColmapDatabase db(database);
  std::map<std::int64_t, std::size_t> all;
  for (const auto& image : db.Images()) all[image.id] = 0;
  db.SetCameras({camera}, true, all);
}

void Extract(const Capture& capture, const CameraPlan& cameras, const FeatureLimits& limits, const fs::path& database,
             const ColmapJob& job) {
  const auto& [options, work_folder, colmap, sink] = job;
  const fs::path list = work_folder / kPhotoList;
  const auto run = [&](bool gpu) {
    const CameraModel model = cameras.known ? cameras.known->model : cameras.model;
    std::vector<ColmapOption> arguments = {
        {"database_path", database.string()},
        {"image_path", capture.folder.string()},
        {"image_list_path", list.string()},
        {"ImageReader.camera_model", std::string(Name(model))},
        {cameras.shared ? "ImageReader.single_camera" : "ImageReader.single_camera_per_image", "1"},
        {"SiftExtraction.use_gpu", gpu ? "1" : "0"},
        {"SiftExtraction.max_image_size", std::to_string(limits.max_image_size_px)},
        {"SiftExtraction.max_num_features", std::to_string(limits.max_features)},
        {"SiftExtraction.num_threads", options.threads > 0 ? std::to_string(options.threads) : "-1"}};
    if (cameras.known) arguments.push_back({"ImageReader.camera_params", ParamsText(*cameras.known)});
    if (!options.masks.empty()) arguments.push_back({"ImageReader.mask_path", options.masks.string()});
    return colmap.Run("feature_extractor", arguments, "finding features (COLMAP)",
                      static_cast<long>(capture.photos.size()));
  };
  int rc = run(colmap.has_cuda());
  if (rc != 0 && colmap.has_cuda()) {
    sink.Message("COLMAP could not use the GPU; features are found on the CPU");
    rc = run(false);
  }
  if (!ColmapDatabase::IsDatabase(database)) {
    const std::string complaint = colmap.LastComplaint();
    throw MachineError(fmt::format("COLMAP made no database; its feature extraction ended with {}{}", rc,
                                   complaint.empty() ? "" : " (" + complaint + ")"),
                       "see the log", colmap.log_file());
  }
}

// COLMAP's list of pairs parts two names at a blank, so that it cannot hold names with blanks: while it reads the list,
// the images of such a capture are called by their numbers, in a copy of the database that then takes its place.
class ListedPairs {
 public:
  ListedPairs(const Capture& capture, const PhotoPairs& pairs, const fs::path& database, const fs::path& folder)
      : list_(folder / "pairs.txt"), database_(database), used_(database) {
    std::map<std::string, std::string> called;
    for (const InputPhoto& photo : capture.photos) called[photo.name] = photo.name;
    if (std::ranges::any_of(called,
                            [](const auto& c) { return c.first.find_first_of(" \t\r\n") != std::string::npos; }))
      Number(folder / "pairs.db", called);
    std::string text;
    for (const auto& [a, b] : pairs)
      text += called.at(capture.photos[static_cast<std::size_t>(a)].name) + " " +
              called.at(capture.photos[static_cast<std::size_t>(b)].name) + "\n";
    WriteTextAtomically(list_, text);
  }
  const fs::path& list() const { return list_; }
  const fs::path& database() const { return used_; }
  // The copy, now with COLMAP's matches, gets its names back and takes the database's place.
  void Finish() const {
    if (used_ == database_) return;
    ColmapDatabase(used_).Rename(before_);
    fs::rename(used_, database_);
  }

 private:
  void Number(const fs::path& copy, std::map<std::string, std::string>& called) {
    RemoveDatabase(copy);
    fs::copy_file(database_, copy);
    used_ = copy;
    std::map<std::int64_t, std::string> numbers;
    ColmapDatabase db(copy);
    for (const auto& image : db.Images()) {
      before_[image.id] = image.name;
      called[image.name] = numbers[image.id] = fmt::format("image-{}", image.id);
    }
    db.Rename(numbers);
  }

  fs::path list_, database_, used_;
  std::map<std::int64_t, std::string> before_;
};

// pairs: by index, with kListed.
void Match(const Capture& capture, PairChoice choice, const PhotoPairs& pairs, const fs::path& database,
           const ColmapJob& job) {
  const auto& [options, work_folder, colmap, sink] = job;
  std::optional<ListedPairs> listed;
  if (choice == PairChoice::kListed) listed.emplace(capture, pairs, database, work_folder);
  const auto n = capture.photos.size();
  const auto run = [&](bool gpu) {
    std::vector<ColmapOption> arguments = {
        {"database_path", (listed ? listed->database() : database).string()},
        {"SiftMatching.use_gpu", gpu ? "1" : "0"},
        {"SiftMatching.num_threads", options.threads > 0 ? std::to_string(options.threads) : "-1"},
        {"random_seed", std::to_string(options.seed), false}};
    if (listed) {
      arguments.push_back({"match_list_path", listed->list().string()});
      arguments.push_back({"match_type", "pairs"});
      return colmap.Run("matches_importer", arguments, "matching chosen pairs (COLMAP)", 0);
    }
    if (choice == PairChoice::kNeighbours) {
      arguments.push_back({"SequentialMatching.overlap", std::to_string(kSequentialOverlap)});
      arguments.push_back({"SequentialMatching.quadratic_overlap", "1", false});
      return colmap.Run("sequential_matcher", arguments, "matching neighbours (COLMAP)", static_cast<long>(n));
    }
    // COLMAP tells its progress once a block: small blocks for a bar that moves, large enough to keep all cores busy.
    const auto block = std::clamp<std::size_t>((n + 5) / 6, 4, 50);
    arguments.push_back({"ExhaustiveMatching.block_size", std::to_string(block)});
    const auto blocks = static_cast<long>((n + block - 1) / block);
    return colmap.Run("exhaustive_matcher", arguments, "matching photos (COLMAP)", blocks * blocks);
  };
  int rc = run(colmap.has_cuda());
  if (rc != 0 && colmap.has_cuda()) {
    sink.Message("COLMAP could not use the GPU; photos are matched on the CPU");
    rc = run(false);
  }
  if (rc != 0)
    throw MachineError(fmt::format("COLMAP's matching ended with {} ({})", rc, colmap.LastComplaint()), "see the log",
                       colmap.log_file());
  if (listed) listed->Finish();
}

// Neighbours in the order of names, as COLMAP's sequential matcher has them with quadratic_overlap.
PhotoPairs Neighbours(int n) {
  PhotoPairs pairs;
  for (int a = 0; a < n; ++a) {
    std::set<int> others;
    for (int i = 1; i < kSequentialOverlap; ++i) others.insert(a + i);
    for (int i = 0; i < kSequentialOverlap; ++i) others.insert(a + (1 << i));
    for (const int b : others)
      if (b < n) pairs.emplace_back(a, b);
  }
  return pairs;
}

PhotoPairs AllPairs(int n) {
  PhotoPairs pairs;
  for (int a = 0; a < n; ++a)
    for (int b = a + 1; b < n; ++b) pairs.emplace_back(a, b);
  return pairs;
}

// The verified ones among the pairs that were tried, whatever order an earlier run tried them in: what is tried next
// must not depend on that order.
std::vector<VerifiedPair> Verified(const std::vector<std::string>& names, const PhotoPairs& tried,
                                   const fs::path& database) {
  const ColmapDatabase db(database);
  std::map<std::string, int> index;
  for (std::size_t i = 0; i < names.size(); ++i) index[names[i]] = static_cast<int>(i);
  std::map<std::int64_t, int> photo_of;
  for (const auto& image : db.Images())
    if (const auto i = index.find(image.name); i != index.end()) photo_of[image.id] = i->second;
  std::vector<VerifiedPair> verified;
  for (const DatabasePair& pair : db.VerifiedPairs()) {
    const auto a = photo_of.find(pair.image1), b = photo_of.find(pair.image2);
    if (a == photo_of.end() || b == photo_of.end()) continue;
    if (std::ranges::binary_search(tried, std::minmax({a->second, b->second})))
      verified.push_back({a->second, b->second, pair.matches});
  }
  return verified;
}

// `names`: of the capture's photos.
void MatchChosen(const Capture& capture, const std::vector<std::string>& names, const PairHints& hints,
                 const Features& features, const ColmapJob& job) {
  const auto n = static_cast<int>(names.size());
  const PairChoice choice = ChoosePairs(job.options, names.size(), capture.is_video);
  const auto match = [&](const PhotoPairs& pairs) {
    if (features.own)
      MatchOwnFeatures(names, pairs, features.database, job);
    else
      Match(capture, choice, pairs, features.database, job);
  };
  if (choice == PairChoice::kAll) return match(features.own ? AllPairs(n) : PhotoPairs());
  if (choice == PairChoice::kNeighbours) return match(features.own ? Neighbours(n) : PhotoPairs());
  if (hints.is_all && !hints.near.empty()) return match(hints.near);
  const ViewGraph graph(names, features.database, job.options.seed, job.sink);
  PhotoPairs tried = Joined(graph.Similar(PartnersOf(job.options, capture.is_video), job.sink), hints.near);
  tried = Joined(std::move(tried), capture.is_video ? Neighbours(n) : NearByGps(capture.photos));
  match(tried);
  for (int round = 0; round < kMoreRounds; ++round) {
    const PhotoPairs next = graph.Next(tried, Verified(names, tried, features.database), job.sink);
    if (next.empty()) break;
    match(next);
    tried = Joined(std::move(tried), next);
  }
  job.sink.Message(fmt::format("{} of {} pairs of photos were tried: {} (--matching exhaustive tries all)",
                               tried.size(), std::size_t(n) * std::size_t(n - 1) / 2,
                               capture.is_video ? "neighbours in time, and frames that look alike"
                                                : "photos that look alike, and what their matches made likely"));
}

}  // namespace

bool UseOwnFeatures(const ReconstructOptions& options) { return options.finder != FeatureFinder::kColmap; }

Camera GuessCamera(CameraModel model, int width_px, int height_px, double focal_35mm) {
  constexpr double kDefaultFocalFactor = 1.2;  // of the longer side: COLMAP's own guess where there is no EXIF
  Camera camera;
  camera.model = model;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.params = {std::max(width_px, height_px) * (focal_35mm > 0 ? focal_35mm / kFilm35WidthMm : kDefaultFocalFactor),
                   width_px / 2.0, height_px / 2.0};
  camera.params.resize(static_cast<std::size_t>(ParameterCount(model)), 0.0);
  return camera;
}

bool LensIsUnknown(const InputPhoto& photo) { return !photo.focal_35mm && !photo.focal_mm; }

bool SplitUnknownLenses(const Capture& capture, const fs::path& database) {
  if (!GroupCameras(capture, database, true)) return false;
  TakeFocalLengths(capture, database);
  return true;
}

CameraPlan PlanCameras(const Capture& capture, const ReconstructOptions& options) {
  CameraPlan plan;
  std::set<std::pair<int, int>> sizes;
  std::set<std::string> settings;
  for (const InputPhoto& photo : capture.photos) {
    sizes.insert({photo.width_px, photo.height_px});
    settings.insert(LensSetting(photo));
  }
  if (!options.camera_yaml.empty()) {
    Camera camera = ReadCameraYaml(options.camera_yaml);
    if (sizes.size() != 1)
      throw DataError("one camera.yaml for photos of different sizes",
                      "leave out the photos of other cameras, or leave out --camera", options.camera_yaml);
    const auto [width, height] = *sizes.begin();
    if (camera.width_px != width || camera.height_px != height) {
      RequireScalable(camera.width_px, camera.height_px, width, height, options.rescale_cameras, options.camera_yaml);
      camera = camera.Scaled(width, height);
    }
    plan.known = camera;
    plan.model = camera.model;
    plan.shared = true;
    return plan;
  }
  if (options.single_camera == SingleCamera::kYes && sizes.size() != 1)
    throw DataError(fmt::format("--single-camera yes, but the photos have {} different sizes", sizes.size()),
                    "use --single-camera auto");
  plan.shared = options.single_camera == SingleCamera::kYes ||
                (options.single_camera == SingleCamera::kAuto && sizes.size() == 1 && settings.size() == 1);
  if (plan.shared && capture.photos.size() >= kPhotosForRadial) plan.model = CameraModel::kRadial;
  return plan;
}

FeatureLimits LimitsFor(const ReconstructOptions& options, std::size_t photos) {
  Quality quality = options.quality;
  constexpr std::size_t kFewPhotos = 24, kManyPhotos = 200;
  if (quality == Quality::kAuto)
    quality = photos <= kFewPhotos ? Quality::kHigh : photos <= kManyPhotos ? Quality::kMedium : Quality::kLow;
  FeatureLimits limits = quality == Quality::kHigh     ? FeatureLimits{3200, 8192}
                         : quality == Quality::kMedium ? FeatureLimits{2000, 4096}
                                                       : FeatureLimits{1200, 2048};
  if (options.max_image_size_px > 0) limits.max_image_size_px = options.max_image_size_px;
  if (options.max_features > 0) limits.max_features = options.max_features;
  return limits;
}

PairChoice ChoosePairs(const ReconstructOptions& options, std::size_t photos, bool is_video) {
  switch (options.matching) {
    case Matching::kExhaustive: return PairChoice::kAll;
    case Matching::kSimilar: return PairChoice::kListed;
    case Matching::kSequential: return PairChoice::kNeighbours;
    case Matching::kAuto: break;
  }
  if (options.partners > 0) return PairChoice::kListed;
  return photos > (is_video ? kMaxExhaustiveKeyframes : kMaxExhaustivePhotos) ? PairChoice::kListed : PairChoice::kAll;
}

int PartnersOf(const ReconstructOptions& options, bool is_video) {
  if (options.partners > 0) return options.partners;
  return is_video ? kSimilarFrames : kSimilarPhotos;
}

Features FindAndMatchFeatures(const Capture& capture, const CameraPlan& cameras, const ColmapJob& job,
                              const PairHints& hints) {
  const auto& [options, work_folder, colmap, sink] = job;
  Features features;
  features.database = work_folder / "database.db";
  const fs::path key_file = work_folder / "features.json";
  const FeatureLimits limits = LimitsFor(options, capture.photos.size());
  std::set<std::string> names;
  std::vector<std::string> in_order;
  for (const InputPhoto& photo : capture.photos) in_order.push_back(photo.name);
  names.insert(in_order.begin(), in_order.end());
  const fs::path user_database = UserDatabase(capture, options, names);

  // What a user's database lacks is found by the program that made it.
  bool own = user_database.empty() && UseOwnFeatures(options);
  const FeatureKey key = KeyOf(capture, cameras, limits, options, user_database, own);
  std::error_code ec;
  if (!Serves(key_file, key) || !ColmapDatabase::IsDatabase(features.database) ||
      !SurvivedRestart(work_folder, features.database, sink)) {
    RemoveDatabase(features.database);
    if (!user_database.empty()) {
      sink.Message("features and matches come from " + user_database.string() + " (copied)");
      const fs::path wal = user_database.string() + "-wal";  // what its last writer has not merged yet
      if (fs::exists(wal, ec))
        fs::copy_file(wal, features.database.string() + "-wal", fs::copy_options::overwrite_existing);
      WriteFileAtomically(features.database, [&](const fs::path& temporary) {
        fs::copy_file(user_database, temporary, fs::copy_options::overwrite_existing);
      });
    }
  }
  NoteRunOfMachine(work_folder);
  WriteTextAtomically(key_file, JsonKeys(key).Text(1));
  std::string list;
  for (const std::string& name : in_order) list += name + "\n";
  WriteTextAtomically(work_folder / kPhotoList, list);

  StepClock clock;
  std::size_t known = 0;
  if (fs::exists(features.database, ec)) known = CountKnown(features.database, names);
  if (known == names.size()) {
    features.reused.push_back("features");
  } else {
    own = own && FindOwnFeatures({.folder = capture.folder,
                                  .photos = capture.photos,
                                  .masks = options.masks,
                                  .cameras = cameras,
                                  .limits = limits},
                                 features.database, job);
    if (!own) Extract(capture, cameras, limits, features.database, job);
    known = CountKnown(features.database, names);
    if (known == 0)
      throw DataError(
          own ? fmt::format("none of the {} photos could be read", names.size())
              : fmt::format("COLMAP could read none of the {} photos ({})", names.size(), colmap.LastComplaint()),
          "see the log", colmap.log_file());
    features.steps.push_back(clock.Lap("features"));
  }
  features.own = own && !ColmapDatabase(features.database).HasRigs();
  if (cameras.known)
    SetKnownCamera(*cameras.known, features.database);
  else if (user_database.empty()) {
    if (cameras.shared || options.single_camera == SingleCamera::kAuto) GroupCameras(capture, features.database, false);
    TakeFocalLengths(capture, features.database);
  }

  const auto matched = ColmapDatabase(features.database).MatchedPairs().size();
  const bool exhausted = matched >= known * (known - 1) / 2;
  if (exhausted || (!user_database.empty() && matched > 0 && features.reused.size() == 1)) {
    features.reused.push_back("matches");
  } else {
    MatchChosen(capture, in_order, hints, features, job);
    features.steps.push_back(clock.Lap("matching"));
  }
  return features;
}

}  // namespace lumi
