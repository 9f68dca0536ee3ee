// Depth maps of all photos of a scene, by PatchMatch stereo in four rounds: at half the size photos alone, then with
// the maps of their sources; at the full size from there, twice. A round reads the maps of the round before, of the
// photo and its sources alone, so photos may be done in any order, by several processes, and a run that was killed goes
// on with the photo it was at.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proxy/dense/depth_store.h"
#include "proxy/dense/patch_match.h"
#include "proxy/dense/source_views.h"
#include "scene/model/scene.h"
#include "scene/program/part.h"
#include "scene/program/progress.h"

namespace lumi {

struct StereoOptions {
  int width = 640;     // of a map's longer side, pixels
  int views = 6;       // photos that one is compared with, 1 .. 16
  int iterations = 4;  // of the first round; the others follow from it
  int memory_mb = 1024;
  std::uint32_t seed = 0;
};
std::string Validate(const StereoOptions& options);
std::map<std::string, std::string> OptionValues(const StereoOptions& options);

struct StereoRound {
  int halvings = 0, iterations = 0;
  bool geometric = false;  // the sources' maps of the round before count
};

struct StereoSummary {
  std::size_t photos = 0;            // with a map
  std::vector<std::string> without;  // photos that share no point with another, or see too few
  std::size_t pixels = 0;            // of all maps
  std::size_t reused = 0;            // maps of any round that an earlier run had finished
  std::size_t given = 0;             // photos whose maps are another run's
  std::size_t unfinished = 0;        // of a part: photos whose maps wait for other parts' ...
  std::vector<int> waits_for;        // ... which are these, ascending
  double seconds = 0;
};

// Pixels of all photos' maps together.
double StereoPixels(const Scene& scene, int width);

// Longer sides of maps that are chosen among where none is given.
inline constexpr std::array<int, 3> kStereoWidths = {640, 480, 320};

// The maps' longer side where nobody says how large they may be: 640 up to 120 photos of 640x480 (20 minutes on two
// cores, with their meshes), 480 as long as all maps together have no more pixels than those, 320 up to 1,000 photos;
// 0: there are more. Counted, not timed: a busy machine, or another one, makes the same of the same photos.
int UsualStereoWidth(const Scene& scene);

// Wall-clock seconds that StereoMaps will take on this machine with the threads there are: how long a score takes is
// measured for some milliseconds, how many there are is known. Within a factor of two where nothing else runs.
double EstimateStereoSeconds(const Scene& scene, const StereoOptions& options);

// The maps of a scene's photos; views as in Scene::views.
class StereoMaps {
 public:
  // Makes them, or takes what `folder` has of the same scene and options; the scene must outlive them. Throws as
  // PickSources. `given`: another run's folder, of the same cameras and options with observations of fewer photos; its
  // finished maps are taken as they are (they were compared with those photos only), and the others go on from them.
  // `rounds`: the first so many only, for tests of what a kill leaves.
  static constexpr int kRounds = 4;
  StereoMaps(const Scene& scene, const StereoOptions& options, const std::filesystem::path& folder,
             ProgressSink& progress, const std::filesystem::path& given = {}, int rounds = kRounds);
  // The maps of a part of the photos, as far as they go: a round needs other parts' maps of the round before where
  // these hold a photo's sources (StereoSummary::unfinished). After at most kRounds runs of all parts, at the same time
  // or not, all maps are there. Only the summary is of use; the maps are for StereoMaps without a part, which removes
  // what is in between.
  StereoMaps(const Scene& scene, const StereoOptions& options, const std::filesystem::path& folder, const Part& part,
             ProgressSink& progress);

  const StereoSummary& summary() const { return summary_; }
  const std::vector<std::vector<SourceView>>& sources() const { return sources_; }
  // nullptr: it has none.
  std::shared_ptr<const DepthMap> Load(std::size_t view);
  const StereoCamera& CameraOf(std::size_t view) const { return pictures_[view].camera; }

 private:
  void Open(const std::filesystem::path& folder, const std::filesystem::path& given, ProgressSink& progress);
  void PickPhotos();
  void FindGiven(const std::filesystem::path& folder);
  void TakeGiven(const std::filesystem::path& folder);
  std::string Key() const;
  std::shared_ptr<const DepthMap> MapBefore(std::size_t view, int round, int width, int height);
  void ReadPhotos(ProgressSink& progress);
  void RemoveBetween(int number);
  // Whether a photo's map of a round can be made: what it reads is there.
  bool IsReady(std::size_t view, const StereoRound& round, int number) const;
  // Makes the round's maps of all photos that are at it and ready; returns how many.
  std::size_t Match(const StereoRound& round, int number, Progress& progress);
  void MatchPhoto(std::size_t view, const StereoRound& round, int number);
  DepthMap StartOf(std::size_t view, const StereoPicture& picture, int number);
  StereoPicture PictureOf(std::size_t view, int halvings) const;
  long WorkOf(std::size_t view, const StereoRound& round) const;
  long WorkOf(const std::array<StereoRound, kRounds>& rounds) const;

  const Scene& scene_;
  StereoOptions options_;
  std::vector<std::vector<SourceView>> sources_;
  std::vector<bool> takes_part_;
  std::vector<bool> given_;  // its map is there from the beginning
  std::optional<Part> part_;
  std::vector<bool> mine_;  // its map is made here
  std::vector<int> next_;   // the round that a photo is at; kRounds: it has its map, or is not made here
  std::vector<StereoPicture> pictures_;
  std::unique_ptr<DepthStore> store_;
  StereoSummary summary_;
};

}  // namespace lumi
