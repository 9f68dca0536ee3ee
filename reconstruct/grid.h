// Cameras that are assumed when nothing else is known: a planar grid of parallel cameras, as a light field is taken.
//
// What such photos say is each point's shift between them, so many pixels for each unit that the camera moves:
// f / Z - f / D, where the photos were rectified to coincide on a plane at distance D (D infinite: they were not).
// Another focal length with depths that follow, or another D, gives the same photos: neither can be found, and any
// serves views from the cameras' plane. So f may be assumed, and D is put such that what the photos show lies in front
// of the cameras.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "reconstruct/known_cameras.h"
#include "reconstruct/options.h"
#include "reconstruct/photos.h"
#include "reconstruct/rig_matches.h"
#include "scene/geometry/rigid3.h"

namespace lumi {

struct GridPosition {
  double horizontal = 0, vertical = 0;
};

// Seen along +z, z = 0.
Rigid3 GridPose(double horizontal, double vertical);

// Rows x columns from "17x17"; throws UsageError.
std::pair<int, int> ParseGridSize(const std::string& text);

// From names as the Stanford light field archives have them: out_ROW_COLUMN_VERTICAL_HORIZONTAL.jpg; nullopt: another
// name.
std::optional<GridPosition> PositionFromName(const std::string& name);

// One a photo: --grid-positions, --grid-size, or the photos' names. Throws DataError, InputError, UsageError.
std::vector<GridPosition> GridPositions(const Capture& capture, const ReconstructOptions& options);

// Which way the coordinates run and where the photos coincide.
struct GridFit {
  double sign_h = 1, sign_v = 1;
  double shear_px = 0;       // f / D: pixels by which the principal point moves for each unit of the camera
  bool signs_known = false;  // false: the shifts run both ways, so near and far might be exchanged
  double agreement = 0;      // share of the matches within 2 px of a shift along the cameras' movement
};
// plane: D as given, with 0 for photos that were not rectified; nullopt: found. Throws DataError where nothing matches.
GridFit FitGrid(const std::vector<GridPosition>& positions, const std::vector<RigMatch>& matches, double focal_px,
                std::optional<double> plane);

std::vector<HeldView> AssumeGrid(const Capture& capture, const ReconstructOptions& options,
                                 const std::vector<GridPosition>& positions, const std::filesystem::path& database,
                                 ProgressSink& sink);

}  // namespace lumi
