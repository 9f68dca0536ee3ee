// A mesh moved onto points by iterated closest points (Besl & McKay 1992, Chen & Medioni 1992), a similarity: seven
// unknowns. Of the points the share that fits is found with it (fractional root mean square distance, Phillips, Liu &
// Tomasi 2007), since a mesh need not show all that the points do, nor they all of it.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "scene/geometry/mesh.h"
#include "scene/geometry/similarity3.h"

namespace lumi {

struct IcpOptions {
  int max_iterations = 200;
  double min_overlap = 0.4;       // of the points near the mesh, the share that is fitted at least; (0, 1]
  double reach = 0.25;            // near: within the mesh's bounding box and so much of its diagonal more on each side
  double max_rms = 0.015;         // of the mesh's diagonal: more is no fit
  double max_scale = 3;           // from the guess, either way
  std::size_t max_points = 4000;  // evenly picked beyond
};

struct IcpResult {
  bool converged = false;
  std::string why_not;          // empty where it did
  Similarity3 scene_from_mesh;  // also where it did not: as far as it came
  double rms = 0;               // of the fitted points' distances from the mesh, in world units
  double rms_of_diagonal = 0;   // the same over the mesh's diagonal in the scene
  std::size_t points = 0;       // near the mesh
  double overlap = 0;           // share of them that is fitted
  int iterations = 0;
  double weakest = 1;  // least over largest eigenvalue of the seven unknowns: 0 for a shape that slides along itself
};

// Deterministic. `mesh` in its own frame and without flaws (RepairMesh); `guess`: scene_from_mesh.
IcpResult AlignByIcp(const Mesh& mesh, const std::vector<Eigen::Vector3d>& points, const Similarity3& guess,
                     const IcpOptions& options = {});

}  // namespace lumi
