#include "proxy/simplify/simplify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>

#include "proxy/simplify/mesh_topology.h"
#include "proxy/simplify/pixel_scale.h"
#include "proxy/simplify/progressive_hull.h"
#include "proxy/simplify/quadric_decimation.h"
#include "proxy/simplify/tight_wrap.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// Smaller meshes are simplified as they are: a wrap's offset is volume, and their time is short anyway.
constexpr std::size_t kWrapFaces = 20000;
// More faces than this are kept from the mesh itself, unless its handles would leave too few of them to its shape.
constexpr std::size_t kFinestWrapped = 4000;
constexpr std::size_t kFacesPerLeast = 4;
// A wrap of gaps down to size / d has about 2 d^2 faces. Coarser than a 60th it costs more volume than simplifying
// does.
constexpr double kCoarsestGap = 60;
constexpr double kWrapFacesPerFace = 4;
constexpr double kQuadricGap = 100;
// A mesh with fewer faces is a body of few sides, whose wrap would have more faces.
constexpr std::size_t kLeastWrapped = 2000;
// The wrap's offset, of alpha: half of it is more faces and time for a hundredth of volume.
constexpr double kOffsetPerGap = 0.05;

// What the wrap is to have, as the inverse of its gap in sizes; 0: none.
double WrapFor(const MeshParts& parts, std::size_t input_faces, std::size_t wanted) {
  if (input_faces < kWrapFaces || 2 * wanted > input_faces) return 0;
  if (wanted > kFinestWrapped && wanted >= kFacesPerLeast * parts.least_faces) return 0;
  return std::max(kCoarsestGap, std::sqrt(kWrapFacesPerFace / 2 * static_cast<double>(wanted)));
}

}  // namespace

std::string Name(SimplifyMethod method) {
  switch (method) {
    case SimplifyMethod::kQuadric: return "quadric";
    case SimplifyMethod::kInPixels: return "in-pixels";
    case SimplifyMethod::kKeepHull: return "keep-hull";
  }
  return "";
}

std::vector<SimplifiedMesh> Simplify(const Mesh& input, const std::vector<std::size_t>& faces, SimplifyMethod method,
                                     ProgressSink& progress, const std::vector<ProxyView>& views) {
  for (const std::size_t n : faces)
    if (n < 1) throw UsageError("--faces must be at least 1");
  const auto start = std::chrono::steady_clock::now();
  const Mesh mesh = MakeManifold(input);
  const MeshParts parts = CountParts(mesh);
  const bool closed = parts.closed_parts == parts.parts;
  if (method == SimplifyMethod::kKeepHull && !closed)
    throw DataError("the mesh is open: only a closed one has an inside to keep", "simplify it without --keep-hull");
  const auto require = [&](const MeshParts& p, std::size_t wanted) {
    if (wanted >= p.least_faces) return;
    if (closed && wanted < 4)
      throw UsageError(fmt::format("{} faces enclose nothing", wanted), "a closed mesh needs four at least");
    throw DataError(fmt::format("{} faces are too few: {} parts with {} holes through them need {} at least", wanted,
                                p.parts, p.handles, p.least_faces),
                    fmt::format("--faces {} or more", p.least_faces));
  };

  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : mesh.vertices) box.extend(v);
  const double size = box.sizes().maxCoeff();
  std::vector<SimplifiedMesh> results(faces.size());
  const double checked = SecondsSince(start);
  if (method != SimplifyMethod::kKeepHull) {
    // Handles that would take most of the faces are closed by a wrap here too.
    std::array<std::vector<std::size_t>, 2> groups;
    for (std::size_t i = 0; i < faces.size(); ++i)
      groups[closed && mesh.faces.size() >= kWrapFaces && faces[i] < kFacesPerLeast * parts.least_faces ? 1 : 0]
          .push_back(i);
    for (const bool wrapped : {false, true}) {
      const std::vector<std::size_t>& members = groups[wrapped ? 1 : 0];
      if (members.empty()) continue;
      const auto run_start = std::chrono::steady_clock::now();
      Mesh wrap;
      if (wrapped) {
        Progress step(progress, "wrapping", 0);
        wrap = MakeManifold(TightWrap(mesh, size / kQuadricGap, kOffsetPerGap * size / kQuadricGap));
      }
      std::vector<std::size_t> wanted;
      for (const std::size_t i : members) wanted.push_back(faces[i]);
      for (const std::size_t n : wanted) require(wrapped ? CountParts(wrap) : parts, n);
      const double before = SecondsSince(run_start);
      const Mesh& from = wrapped ? wrap : mesh;
      std::vector<double> scale;
      if (method == SimplifyMethod::kInPixels) scale = PixelScale(from, views);
      std::vector<DecimatedMesh> made = Decimate(from, wanted, progress, scale);
      for (std::size_t k = 0; k < members.size(); ++k)
        results[members[k]] = {std::move(made[k].mesh), checked + before + made[k].seconds, made[k].reached, wrapped};
    }
    return results;
  }

  std::map<double, std::vector<std::size_t>> runs;
  for (std::size_t i = 0; i < faces.size(); ++i) runs[WrapFor(parts, mesh.faces.size(), faces[i])].push_back(i);
  for (const auto& [inverse_gap, members] : runs) {
    const auto run_start = std::chrono::steady_clock::now();
    bool wrapped = inverse_gap > 0;
    Mesh wrap;
    if (wrapped) {
      Progress step(progress, "wrapping", 0);
      wrap = MakeManifold(TightWrap(mesh, size / inverse_gap, kOffsetPerGap * size / inverse_gap));
    }
    const Mesh& from = wrapped ? wrap : mesh;
    const MeshParts from_parts = wrapped ? CountParts(wrap) : parts;
    std::vector<std::size_t> wanted;
    for (const std::size_t i : members) {
      require(from_parts, faces[i]);
      wanted.push_back(faces[i]);
    }
    double before = checked + SecondsSince(run_start);
    ProgressiveHullSummary summary;
    std::vector<KeptHull> made = KeepHull(from, wanted, progress, &summary);
    const bool all = std::ranges::all_of(made, [](const KeptHull& hull) { return hull.reached; });
    if (!wrapped && (!all || summary.fell_back) && mesh.faces.size() >= kLeastWrapped) {
      // The simplified mesh keeps too many faces, or runs through itself: a wrap does neither.
      wrapped = true;
      const double gap = size / kCoarsestGap;
      wrap = MakeManifold(TightWrap(mesh, gap, kOffsetPerGap * gap));
      before = checked + SecondsSince(run_start);
      made = KeepHull(wrap, wanted, progress, &summary);
    }
    for (std::size_t k = 0; k < members.size(); ++k)
      results[members[k]] = {std::move(made[k].mesh), before + made[k].seconds, made[k].reached, wrapped};
  }
  return results;
}

}  // namespace lumi
