// Frames without rank-4 structure: a camera that only turns or zooms, one plane, a tripod (thesis sec. 2.5 leaves them
// out; a shaky video is full of them). What relates the frames are homographies, and as a quasi-affine scene these are
// cameras that share one centre, P = [G | 0], with points on the unit sphere about it: x ~ G d. Angles between their
// rays are zero, as they should be: every frame holds the same light.
#pragma once

#include "reconstruct/factorization/reconstruct_from_tracks.h"

namespace lumi {

struct HomographyOptions {
  double inlier_px = 3;        // RANSAC's, between neighbouring frames
  int sights_per_frame = 200;  // that steer the adjustment; 0: all
  int max_iterations = 30;     // of the keys' adjustment
  int rounds = 2;              // in which frames and points are adjusted in turns
};

// `ordered`: frames follow one another, as a video's do. Homographies between neighbours (RANSAC, so that what moves by
// itself up to about 40 % of a picture is outvoted; in parallel), chained from the middle; keys, some frames apart,
// adjusted at once with all tracks that two of them see (Cauchy's loss, Ceres); then the frames between them and all
// points, in turns and in parallel. A frame that shares too few tracks with its neighbour is taken not to have moved
// against it and is named in `missing`, though it is placed. Placed are all frames; upgrade is kQuasiAffine, the plane
// at infinity (0,0,0,1). Throws DataError for no frame.
FactorizationResult ReconstructByHomographies(const Tracks& tracks, const HomographyOptions& options,
                                              ProgressSink& progress);

// For frames that see fewer than 24 points of a result of ReconstructByHomographies (a blank wall, black frames):
// directions on a grid of the picture, as tracks that blank frames in a row are said to have seen where their matrices
// put them. Not one of them was observed; with them such frames have something to be rendered on, and pass through as
// they are. Tracks are added to `tracks`; returns how many.
int AddDirectionsWhereBlank(FactorizationResult& result, Tracks& tracks);

// Frames that `result` (quasi-affine) could not place are placed where their nearest placed neighbour stands, turned by
// the homography between them: P = H P_neighbour. How many; those without a homography stay missing.
int PlaceByHomography(FactorizationResult& result, const Tracks& tracks, const HomographyOptions& options);

}  // namespace lumi
