// lumi-stabilize: from the matrices of a shaky video to those of a steady one (thesis sec. 6.4.2).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/files/matrix_path.h"
#include "scene/program/progress.h"
#include "stabilize/filmed_scene.h"
#include "stabilize/motion_models.h"

namespace lumi {

struct StabilizeOptions {
  MotionModel model = MotionModel::kSmooth;
  // smooth: amplitudes at this frequency are halved, slower ones pass. Where the other models have to be left (see
  // min_scale), they are left and joined again as smoothly.
  double cutoff_hz = 0.3;
  // smooth: what no similarity of the filmed picture has (stretch, shear, keystone) is halved at this frequency
  // instead: slow changes of it are the scene's or the tracks' drift, and undoing them bends the picture. Not below
  // cutoff_hz.
  double similar_hz = 0.5;
  // No picture shall have to be cropped further, share of its width: where it would, the path follows the camera more
  // closely.
  double min_scale = 0.8;
  int half_window = 5;  // frames before and after that may fill a picture
  int iterations = 12;  // of targets re-estimated for min_scale's sake; 0: none
  int points = 60;      // of a frame's structure that its matrix is fitted to
  bool crop = true;  // the path's pictures are zoomed until no border shows; false: that is left to the renderer's fill
  std::optional<double> fps;  // where the scene has no times
  // vertigo: the object that is to stay, in pixels of view `object_frame` (in the order of time). A window that goes on
  // from one that kept an object keeps that one.
  std::vector<double> object_px;  // x, y, width, height
  int object_frame = 0;
  std::vector<Eigen::Vector2d> object_points_px;  // or tracks picked by their places there
  // A long video in windows: the path before this one, whose last frames are this one's first.
  std::optional<MatrixPath> before;
  // How many of the last frames get anchors, from which the next window's path goes on. The next window itself shows
  // the frames after the beginning of the seam.
  int anchors = 0;
};

// Empty, or what is wrong.
std::string Validate(const StabilizeOptions& options);

struct StabilizeReport {
  MotionModel model = MotionModel::kSmooth;
  int frames = 0, points = 0, iterations = 0;
  bool homographies = false;  // the frames have no structure
  double view_scale = 1;      // MatrixPath's
  int followed_frames = 0;    // where the path follows the camera more closely, for min_scale's sake
  double shake_before_px = 0,
         shake_after_px = 0;  // above 1 Hz, RMS of the border's and structure's images, along tracks
  double model_rms_px = 0;    // of the sights against the model
  std::optional<Eigen::Vector3d> focus_of_expansion_px;  // homogeneous
  double turn_deg = 0;                                   // circular
  int joined_frames = 0;                                 // that the path before has too
  int first_shown = 0,
      last_shown =
          0;  // the frames between that belong to this path, inclusive: the windows before and after show the others
};

// `film` and the path's P as FilmedScene has them; the path's in pixels of the scene's world. Throws UsageError,
// DataError.
MatrixPath Stabilize(const FilmedScene& film, const StabilizeOptions& options, StabilizeReport& report,
                     ProgressSink& progress);

}  // namespace lumi
