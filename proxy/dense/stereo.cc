#include "proxy/dense/stereo.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <set>

#include "proxy/dense/depth_files.h"
#include "proxy/dense/depth_start.h"
#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/provenance.h"
#include "scene/files/scene_folder.h"
#include "scene/files/scene_masks.h"
#include "scene/program/error.h"
#include "scene/program/parallel_each.h"
#include "scene/program/registers.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// What a run's maps follow from, besides the photos' own bytes.
constexpr int kMethodVersion = 1;
constexpr const char* kPointsLine = "points ";  // the key's last line

}  // namespace

std::string Validate(const StereoOptions& o) {
  if (o.width < 64 || o.width > 8192) return "--width must be 64 to 8192";
  if (o.views < 1 || o.views > static_cast<int>(kMostSources))
    return fmt::format("--views must be 1 to {}", kMostSources);
  if (o.iterations < 1 || o.iterations > 32) return "--iterations must be 1 to 32";
  if (o.memory_mb < 64) return "--memory-mb must be at least 64";
  return {};
}

std::map<std::string, std::string> OptionValues(const StereoOptions& o) {
  return {{"width", std::to_string(o.width)},
          {"views", std::to_string(o.views)},
          {"iterations", std::to_string(o.iterations)},
          {"seed", std::to_string(o.seed)},
          {"method", std::to_string(kMethodVersion)}};
}

namespace {

std::array<StereoRound, StereoMaps::kRounds> Rounds(int n) {
  return {{{1, n, false}, {1, (n + 1) / 2, true}, {0, (n + 1) / 2, true}, {0, (n + 3) / 4, true}}};
}

// Seconds that one thread takes to score one pixel against one photo.
double SecondsAScore() {
  Image8 noise(256, 64, 1);
  for (std::size_t p = 0; p < noise.data.size(); ++p) noise.data[p] = static_cast<std::uint8_t>(p * 2654435761U >> 20);
  const QuadImage quads = PackQuads(noise);
  PairGeometry pair;
  pair.a[0] = pair.a[4] = pair.a[8] = 1;
  PatchBatch patches;
  PlaneBatch planes = {};
  std::array<int, kLanes> x;
  for (int l = 0; l < kLanes; ++l) x[static_cast<std::size_t>(l)] = 40 + 2 * l;
  MakePatches(noise, x.data(), 30, patches);
  std::array<float, kLanes> cost;
  constexpr int kRuns = 400;
  // The fastest of a few: others may be at work.
  double least = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < 5; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    for (int run = 0; run < kRuns; ++run) {
      pair.a[2] = 0.01F * static_cast<float>(run);
      ScorePatches(patches, quads, pair, planes, cost.data());
    }
    least = std::min(least, SecondsSince(start));
  }
  return least / (kRuns * kLanes);
}

}  // namespace

double StereoPixels(const Scene& scene, int width) {
  double pixels = 0;
  for (const View& view : scene.views) {
    const Eigen::Vector2i size = StereoSize(SizePx(scene, view), width);
    pixels += static_cast<double>(size.x()) * size.y();
  }
  return pixels;
}

int UsualStereoWidth(const Scene& scene) {
  constexpr double kMostPixels = 120.0 * 640 * 480, kMostOfSmallest = 1000.0 * 320 * 240;
  for (const int width : kStereoWidths)
    if (StereoPixels(scene, width) <= (width == kStereoWidths.back() ? kMostOfSmallest : kMostPixels)) return width;
  return 0;
}

double EstimateStereoSeconds(const Scene& scene, const StereoOptions& options) {
  constexpr double kTriesAnIteration = 14;  // nine planes that are there and five that are varied
  constexpr double kBesidesScores = 1.6;    // neighbours, sources' weights, geometry: of the scores' time
  double scores = 0;
  for (const StereoRound& round : Rounds(options.iterations))
    scores += (1 + kTriesAnIteration * round.iterations) / (1 << (2 * round.halvings));
  return kBesidesScores * SecondsAScore() * scores * options.views * StereoPixels(scene, options.width) / ThreadCount();
}

StereoMaps::StereoMaps(const Scene& scene, const StereoOptions& options, const std::filesystem::path& folder,
                       ProgressSink& progress, const std::filesystem::path& given, int rounds_made)
    : scene_(scene), options_(options) {
  const Stopwatch watch;
  Open(folder, given, progress);
  const std::array<StereoRound, kRounds> rounds = Rounds(options.iterations);
  Progress steps(progress, "depth maps", WorkOf(rounds));
  for (int r = 0; r < rounds_made; ++r) {
    Match(rounds[static_cast<std::size_t>(r)], r, steps);
    RemoveBetween(r - 1);
  }
  if (rounds_made == kRounds) store_->ForgetParts();
  summary_.seconds = watch.Seconds();
}

StereoMaps::StereoMaps(const Scene& scene, const StereoOptions& options, const std::filesystem::path& folder,
                       const Part& part, ProgressSink& progress)
    : scene_(scene), options_(options), part_(part) {
  const Stopwatch watch;
  Open(folder, {}, progress);
  const std::array<StereoRound, kRounds> rounds = Rounds(options.iterations);
  Progress steps(progress, "depth maps", WorkOf(rounds));
  // Other parts may go on meanwhile, so that what waited for them is ready in the next pass.
  for (std::size_t made = 1; made > 0;) {
    made = 0;
    for (int r = 0; r < kRounds; ++r) made += Match(rounds[static_cast<std::size_t>(r)], r, steps);
  }
  std::set<int> others;
  std::vector<std::string> names;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (!mine_[v]) continue;
    names.push_back(scene.views[v].name);
    if (next_[v] == kRounds) continue;
    ++summary_.unfinished;
    for (const SourceView& s : sources_[v])
      if (const auto other = static_cast<std::size_t>(s.view.value);
          !mine_[other] && !store_->Has(scene.views[other].name, next_[v] - 1))
        others.insert(PartWith(other, scene.views.size(), part.count));
  }
  summary_.waits_for.assign(others.begin(), others.end());
  store_->Flush(names);
  summary_.seconds = watch.Seconds();
}

// Everything up to the first round.
void StereoMaps::Open(const std::filesystem::path& folder, const std::filesystem::path& given, ProgressSink& progress) {
  if (const std::string wrong = Validate(options_); !wrong.empty()) throw UsageError(wrong);
  PickPhotos();
  FindGiven(given);
  const std::size_t photos = scene_.views.size();
  const Part::Range range = part_ ? part_->RangeOf(photos) : Part::Range{0, photos};
  mine_.assign(photos, false);
  for (std::size_t v = range.begin; v < range.end; ++v) mine_[v] = takes_part_[v] && !given_[v];
  StoredMaps maps{.rounds = kRounds};
  std::vector<std::string> mine;
  for (std::size_t v = 0; v < photos; ++v) {
    if (takes_part_[v] && !given_[v]) maps.photos.push_back(scene_.views[v].name);
    if (mine_[v]) mine.push_back(scene_.views[v].name);
  }
  store_ = std::make_unique<DepthStore>(folder, Key(), static_cast<std::size_t>(options_.memory_mb) << 20,
                                        std::move(maps), part_);
  store_->RemoveDamaged(mine);
  TakeGiven(given);
  ReadPhotos(progress);
  next_.assign(photos, kRounds);
  const std::vector<int> next = store_->NextRounds();
  for (std::size_t v = 0, i = 0; v < photos; ++v) {
    if (takes_part_[v] && !given_[v]) {
      if (mine_[v]) next_[v] = next[i];
      ++i;
    }
    if (mine_[v]) summary_.reused += static_cast<std::size_t>(next_[v]);
    if (mine_[v] || given_[v]) summary_.pixels += pictures_[v].grey.data.size();
  }
  if (part_) summary_.photos = static_cast<std::size_t>(std::ranges::count(mine_, true));
}

// Photos that have sources and points of their own, and for each the sources among them.
void StereoMaps::PickPhotos() {
  sources_ = PickSources(scene_, static_cast<std::size_t>(options_.views));
  takes_part_.resize(scene_.views.size());
  for (std::size_t v = 0; v < scene_.views.size(); ++v)
    takes_part_[v] = !sources_[v].empty() && RangeOf(scene_, ViewId{static_cast<std::int32_t>(v)}).has_value();
  // A photo that drops out may have been another's only source.
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t v = 0; v < scene_.views.size(); ++v) {
      std::erase_if(sources_[v],
                    [&](const SourceView& s) { return !takes_part_[static_cast<std::size_t>(s.view.value)]; });
      if (!takes_part_[v] || !sources_[v].empty()) continue;
      takes_part_[v] = false;
      changed = true;
    }
  }
  for (std::size_t v = 0; v < scene_.views.size(); ++v) {
    if (takes_part_[v])
      ++summary_.photos;
    else
      summary_.without.push_back(scene_.views[v].name);
  }
}

// All that the maps follow from: another scene or other options begin anew.
std::string StereoMaps::Key() const {
  std::string key;
  for (const auto& [name, value] : OptionValues(options_)) key += name + " " + value + "\n";
  // The last digits depend on the registers' width.
  key += fmt::format("registers of {} bits\n", 8 * WidestRegister());
  key += "photos " + Fingerprint(scene_.image_folder) + "\nmasks " + Fingerprint(MasksFolder(scene_)) + "\n";
  if (SceneMasks(scene_).as_taken()) key += "masks of the photos as they were taken\n";
  std::error_code error;
  if (const auto silhouettes = scene_.folder / "silhouettes"; std::filesystem::exists(silhouettes, error))
    key += "silhouettes " + Fingerprint(silhouettes) + "\n";
  for (const View& view : scene_.views) {
    const Camera& camera = scene_.CameraOf(view);
    const Rigid3& pose = view.cam_from_world;
    key += fmt::format("camera {} {} {} {} {} {} {}\n", view.name, camera.FocalPx().x(), camera.FocalPx().y(),
                       camera.PrincipalPointPx().x(), camera.PrincipalPointPx().y(),
                       fmt::join(pose.rotation.coeffs().data(), pose.rotation.coeffs().data() + 4, " "),
                       fmt::join(pose.translation.data(), pose.translation.data() + 3, " "));
  }
  for (std::size_t v = 0; v < given_.size(); ++v)
    if (given_[v]) key += "given " + scene_.views[v].name + "\n";
  return key + fmt::format("{}{}\n", kPointsLine, scene_.points.size());
}

// Which maps another run has finished from the same photos, cameras and options. Only its points may be others.
void StereoMaps::FindGiven(const std::filesystem::path& folder) {
  given_.assign(scene_.views.size(), false);
  std::error_code error;
  if (folder.empty() || !std::filesystem::exists(folder / DepthStore::kMadeFrom, error)) return;
  const auto but_points = [](const std::string& key) { return key.substr(0, key.rfind(kPointsLine)); };
  if (but_points(ReadText(folder / DepthStore::kMadeFrom)) != but_points(Key())) return;
  for (std::size_t v = 0; v < scene_.views.size(); ++v) {
    given_[v] = takes_part_[v] &&
                std::filesystem::exists(folder / DepthStore::FileName(scene_.views[v].name, kRounds - 1), error);
    summary_.given += given_[v];
  }
}

void StereoMaps::TakeGiven(const std::filesystem::path& folder) {
  for (std::size_t v = 0; v < scene_.views.size(); ++v)
    if (const std::string& name = scene_.views[v].name; given_[v] && !store_->Has(name, kRounds - 1))
      store_->Store(name, kRounds - 1, ReadPlanes(folder / DepthStore::FileName(name, kRounds - 1)));
}

// Thousand times the pixel updates of a photo in a round; a start is scored once.
long StereoMaps::WorkOf(std::size_t view, const StereoRound& round) const {
  const StereoCamera& camera = pictures_[view].camera;
  const long pixels = static_cast<long>(camera.width) * camera.height >> (2 * round.halvings);
  return 1 + pixels / 1000 * round.iterations;
}

// Of all that is still to be done here.
long StereoMaps::WorkOf(const std::array<StereoRound, kRounds>& rounds) const {
  long work = 0;
  for (std::size_t v = 0; v < next_.size(); ++v)
    for (int r = next_[v]; r < kRounds; ++r) work += WorkOf(v, rounds[static_cast<std::size_t>(r)]);
  return work;
}

void StereoMaps::ReadPhotos(ProgressSink& progress) {
  pictures_.resize(scene_.views.size());
  std::vector<bool> needed = takes_part_;
  if (part_) {
    needed = mine_;
    for (std::size_t v = 0; v < needed.size(); ++v)
      if (mine_[v])
        for (const SourceView& s : sources_[v]) needed[static_cast<std::size_t>(s.view.value)] = true;
  }
  const SceneMasks masks(scene_);
  Progress steps(progress, "reading photos", std::ranges::count(needed, true));
  ParallelEach(scene_.views.size(), 1, [&](std::size_t v) {
    if (!needed[v]) return;
    const View& view = scene_.views[v];
    const Image8 photo = ReadImage8(scene_.ImagePath(view), 3);
    const Eigen::Vector2i size = StereoSize({photo.width, photo.height}, options_.width);
    StereoPicture& picture = pictures_[v];
    picture.camera = MakeStereoCamera(scene_, view, size.x(), size.y());
    picture.grey = GreyOf(Resize(photo, size.x(), size.y()));
    if (const Image8 mask = masks.Of(view); !mask.empty()) {
      picture.ignored = Resize(mask, size.x(), size.y());
      for (std::uint8_t& value : picture.ignored.data) value = static_cast<std::uint8_t>(255 - value);
    }
    const std::filesystem::path silhouette = FindMask(scene_.folder / "silhouettes", view.name);
    if (!silhouette.empty()) picture.object = GreyOf(Resize(ReadImage8(silhouette, 3), size.x(), size.y()));
    steps.Step();
  });
}

StereoPicture StereoMaps::PictureOf(std::size_t view, int halvings) const {
  if (halvings == 0) return pictures_[view];
  const StereoPicture& full = pictures_[view];
  const int width = std::max(1, full.camera.width >> halvings), height = std::max(1, full.camera.height >> halvings);
  StereoPicture half;
  half.camera = Resized(full.camera, width, height);
  half.grey = Resize(full.grey, width, height);
  if (!full.ignored.empty()) half.ignored = Resize(full.ignored, width, height);
  if (!full.object.empty()) half.object = Resize(full.object, width, height);
  return half;
}

// A photo's map after the round before `round`, or the given one, at this size.
std::shared_ptr<const DepthMap> StereoMaps::MapBefore(std::size_t view, int round, int width, int height) {
  const std::string& name = scene_.views[view].name;
  auto map = store_->Load(name, given_[view] ? kRounds - 1 : round - 1);
  if (map->width == width && map->height == height) return map;
  return std::make_shared<const DepthMap>(Resized(*map, width, height));
}

DepthMap StereoMaps::StartOf(std::size_t view, const StereoPicture& picture, int number) {
  const ViewId id{static_cast<std::int32_t>(view)};
  if (number == 0) return StartingPlanes(scene_, id, picture.camera, *RangeOf(scene_, id));
  return *MapBefore(view, number, picture.camera.width, picture.camera.height);
}

bool StereoMaps::IsReady(std::size_t view, const StereoRound& round, int number) const {
  if (!part_ || !round.geometric) return true;
  return std::ranges::all_of(sources_[view], [&](const SourceView& s) {
    return store_->Has(scene_.views[static_cast<std::size_t>(s.view.value)].name, number - 1);
  });
}

std::size_t StereoMaps::Match(const StereoRound& round, int number, Progress& progress) {
  std::size_t made = 0;
  for (std::size_t v = 0; v < scene_.views.size(); ++v) {
    if (next_[v] != number || !IsReady(v, round, number)) continue;
    MatchPhoto(v, round, number);
    ++next_[v];
    ++made;
    progress.Step(WorkOf(v, round));
  }
  return made;
}

void StereoMaps::MatchPhoto(std::size_t v, const StereoRound& round, int number) {
  const StereoPicture reference = PictureOf(v, round.halvings);
  std::vector<StereoPicture> pictures;
  std::vector<std::shared_ptr<const DepthMap>> maps;
  std::vector<MatchSource> sources;
  pictures.reserve(sources_[v].size());
  for (const SourceView& s : sources_[v]) {
    const auto other = static_cast<std::size_t>(s.view.value);
    pictures.push_back(PictureOf(other, round.halvings));
    MatchSource source{&pictures.back(), nullptr};
    if (round.geometric) {
      maps.push_back(MapBefore(other, number, pictures.back().grey.width, pictures.back().grey.height));
      source.map = maps.back().get();
    }
    sources.push_back(source);
  }
  const DepthRange range = *RangeOf(scene_, ViewId{static_cast<std::int32_t>(v)});
  PatchMatchOptions options;
  options.iterations = round.iterations;
  options.seed = options_.seed + 4096 * static_cast<std::uint32_t>(v) + 1024 * static_cast<std::uint32_t>(number);
  options.nearest_w = range.nearest_w;
  options.farthest_w = range.farthest_w;
  // Later rounds start from what is nearly right.
  options.perturbation /= static_cast<float>(1 << number);
  DepthMap map = StartOf(v, reference, number);
  MatchPatches(reference, sources, options, map);
  store_->Store(scene_.views[v].name, number, std::move(map));
}

// Nobody reads the round before the last any more.
void StereoMaps::RemoveBetween(int number) {
  if (number < 0) return;
  for (std::size_t v = 0; v < scene_.views.size(); ++v)
    if (takes_part_[v]) store_->Remove(scene_.views[v].name, number);
}

std::shared_ptr<const DepthMap> StereoMaps::Load(std::size_t view) {
  if (!takes_part_[view]) return nullptr;
  return store_->Load(scene_.views[view].name, kRounds - 1);
}

}  // namespace lumi
