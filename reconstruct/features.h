// Features and matches, inside COLMAP's database: found once, resumed after a kill, reused when nothing changed.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/colmap_program.h"
#include "reconstruct/options.h"
#include "reconstruct/photos.h"
#include "reconstruct/view_graph.h"
#include "scene/model/camera.h"

namespace lumi {

// How photos share cameras while COLMAP estimates them.
struct CameraPlan {
  std::optional<Camera> known;  // held fixed, all photos
  bool shared = false;          // one camera for all photos
  CameraModel model = CameraModel::kSimpleRadial;
};

// One camera for all where the photos have one size and one setting of the lens by EXIF (or none has any). Throws
// UsageError for a camera.yaml or --single-camera yes that does not fit the photos.
CameraPlan PlanCameras(const Capture& capture, const ReconstructOptions& options);

// A camera that nothing is known of but its photos' size, and by EXIF perhaps its focal length (0: not), as COLMAP
// guesses.
Camera GuessCamera(CameraModel model, int width_px, int height_px, double focal_35mm = 0);

// Whether EXIF says nothing of the focal length: such photos share a camera because nothing speaks against it.
bool LensIsUnknown(const InputPhoto& photo);
// In the database: a camera for each photo whose lens is unknown. False where the cameras are not ours to rewrite.
bool SplitUnknownLenses(const Capture& capture, const std::filesystem::path& database);

struct FeatureLimits {
  int max_image_size_px = 0;
  int max_features = 0;
};
// --quality, or by the number of photos: matching grows with the square of both.
FeatureLimits LimitsFor(const ReconstructOptions& options, std::size_t photos);

// Which pairs of photos are matched: each with each; those of neighbours in the order of their names; or those that are
// listed, by what is known of the cameras or by what the photos show.
enum class PairChoice { kAll, kNeighbours, kListed };
PairChoice ChoosePairs(const ReconstructOptions& options, std::size_t photos, bool is_video);
// How many photos that look most like it each is matched with at first, where they are listed.
int PartnersOf(const ReconstructOptions& options, bool is_video);

// Whether features are found and matched here, and not by COLMAP.
bool UseOwnFeatures(const ReconstructOptions& options);

// In the work folder: the photos' names, for COLMAP's image_list_path.
constexpr const char* kPhotoList = "photos.txt";

struct Features {
  std::filesystem::path database;
  std::vector<std::string> reused;
  std::vector<StepTime> steps;  // features, matching: where they were not reused
  bool own = false;             // found here, not by COLMAP
};

// Throws DataError when no photo gave features. work_folder: SCENE/colmap. hints: heeded where there are too many
// photos to match each with all others.
Features FindAndMatchFeatures(const Capture& capture, const CameraPlan& cameras, const ColmapJob& job,
                              const PairHints& hints = {});

}  // namespace lumi
