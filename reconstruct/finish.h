// From cameras with distortion to a scene folder: undistorted photos and masks, sparse model, manifest (written last).
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "reconstruct/given_camera.h"
#include "reconstruct/options.h"
#include "scene/model/scene.h"
#include "scene/program/progress.h"

namespace lumi {

// scene.image_folder holds the photos as they were taken. Returns the scene as written; summary's counts and errors
// are filled in.
Scene FinishScene(Scene scene, const ReconstructOptions& options, ReconstructSummary& summary, ProgressSink& sink);

// Completes what the written scene says of its photos before they were undistorted (scene/files/taken_photos.h): masks
// that are found later are of the user's own files, under their names, and from before a lens with skew or k3 was
// resampled away. skewed: by their names here, cameras of photos that lost a skew alone.
void NoteHowPhotosWereTaken(const Scene& scene, const GivenCamera& given, const std::map<std::string, Camera>& skewed);

// Puts the folder `fresh` in the place of `target`; both lie in one folder.
void ReplaceFolder(const std::filesystem::path& fresh, const std::filesystem::path& target);

// For a run without --masks: removes the scene's masks that an earlier run's record names as its own. Anybody else's
// stay.
void RemoveMasksOfEarlierRun(const std::filesystem::path& scene);

// Colours for points that have none: the photos' pixels at their observations, averaged.
void ColorPoints(Scene& scene, ProgressSink& sink);

}  // namespace lumi
