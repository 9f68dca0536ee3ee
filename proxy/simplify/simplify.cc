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
#include "proxy/simplify/small_parts.h"
#include "proxy/simplify/tight_wrap.h"
#include "scene/program/error.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

// Smaller meshes are simplified as they are: a wrap's offset is volume, and their time is short anyway.
constexpr std::size_t kWrapFaces = 20000;
// More faces than this are kept from the mesh itself, unless its handles would leave too few of them to its shape.
constexpr std::size_t kFinestWrapped = 4000;
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

void RequireInside(std::size_t faces) {
  if (faces < 4) throw UsageError(fmt::format("{} faces enclose nothing", faces), "a closed mesh needs four at least");
}

// What is to be simplified, and what is known of it.
struct Source {
  Mesh mesh;  // a 2-manifold
  MeshParts parts;
  double size = 0;
  std::chrono::steady_clock::time_point start;
  bool IsClosed() const { return parts.closed_parts == parts.parts; }

  // That `wanted` faces are enough for a surface with these parts.
  void Require(const MeshParts& p, std::size_t wanted) const {
    if (wanted >= p.least_faces) return;
    if (IsClosed()) RequireInside(wanted);
    throw DataError(fmt::format("{} faces are too few: {} parts with {} holes through them need {} at least", wanted,
                                p.parts, p.handles, p.least_faces),
                    fmt::format("--faces {} or more", p.least_faces));
  }
};

Source MakeSource(const Mesh& input) {
  Source source{.mesh = {}, .parts = {}, .size = 0, .start = std::chrono::steady_clock::now()};
  source.mesh = MakeManifold(input);
  source.parts = CountParts(source.mesh);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : source.mesh.vertices) box.extend(v);
  source.size = box.sizes().maxCoeff();
  return source;
}

// As near to the surface as can be. Handles of a body that would take most of the faces are closed by a wrap.
std::vector<SimplifiedMesh> Nearest(const Source& source, const std::vector<std::size_t>& faces,
                                    ProgressSink& progress) {
  std::array<std::vector<std::size_t>, 2> groups;
  const bool may_wrap = source.IsClosed() && source.mesh.faces.size() >= kWrapFaces;
  for (std::size_t i = 0; i < faces.size(); ++i)
    groups[may_wrap && faces[i] < kFacesPerLeast * source.parts.least_faces ? 1 : 0].push_back(i);
  std::vector<SimplifiedMesh> results(faces.size());
  const double checked = SecondsSince(source.start);
  for (const bool wrapped : {false, true}) {
    const std::vector<std::size_t>& members = groups[wrapped ? 1 : 0];
    if (members.empty()) continue;
    const auto run_start = std::chrono::steady_clock::now();
    Mesh wrap;
    if (wrapped) {
      Progress step(progress, "wrapping", 0);
      const double gap = source.size / kQuadricGap;
      wrap = MakeManifold(TightWrap(source.mesh, gap, kOffsetPerGap * gap));
    }
    std::vector<std::size_t> wanted;
    for (const std::size_t i : members) wanted.push_back(faces[i]);
    for (const std::size_t n : wanted) source.Require(wrapped ? CountParts(wrap) : source.parts, n);
    const double before = SecondsSince(run_start);
    std::vector<DecimatedMesh> made = Decimate(wrapped ? wrap : source.mesh, wanted, progress);
    for (std::size_t k = 0; k < members.size(); ++k)
      results[members[k]] = {.mesh = std::move(made[k].mesh),
                             .seconds = checked + before + made[k].seconds,
                             .reached = made[k].reached,
                             .wrapped = wrapped,
                             .removed_parts = 0};
  }
  return results;
}

// The same as the photos show it. Nothing is wrapped: the gaps of a wrap follow from the size of the whole, and beside
// its surroundings a scene's objects are small. What floats about and is hardly seen goes instead, and what is left
// gets more faces than wanted where holes through it would take its shape.
std::vector<SimplifiedMesh> NearestInPixels(const Source& source, const std::vector<std::size_t>& faces,
                                            ProgressSink& progress, const std::vector<ProxyView>& views) {
  if (source.IsClosed())
    for (const std::size_t n : faces) RequireInside(n);
  const std::vector<double> scale = PixelScale(source.mesh, views);
  // Parts go in the same order for any number of faces: by how many of them went, the meshes to start from.
  struct Run {
    Mesh mesh;
    std::vector<std::size_t> members, wanted;
  };
  std::map<std::size_t, Run> runs;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    Mesh mesh = source.mesh;
    const SmallParts small = RemoveSmallParts(mesh, faces[i], scale);
    Run& run = runs[small.removed];
    if (run.members.empty()) run.mesh = std::move(mesh);
    run.members.push_back(i);
    run.wanted.push_back(std::max(faces[i], small.least));
  }
  std::vector<SimplifiedMesh> results(faces.size());
  const double checked = SecondsSince(source.start);
  for (const auto& [removed, run] : runs) {
    const auto run_start = std::chrono::steady_clock::now();
    const std::vector<double> scale_here = removed > 0 ? PixelScale(run.mesh, views) : scale;
    const double before = checked + SecondsSince(run_start);
    std::vector<DecimatedMesh> made = Decimate(run.mesh, run.wanted, progress, scale_here);
    for (std::size_t k = 0; k < run.members.size(); ++k) {
      const std::size_t n = made[k].mesh.faces.size();
      results[run.members[k]] = {.mesh = std::move(made[k].mesh),
                                 .seconds = before + made[k].seconds,
                                 .reached = n <= faces[run.members[k]],
                                 .wrapped = false,
                                 .removed_parts = removed};
    }
  }
  return results;
}

// Encloses the former.
std::vector<SimplifiedMesh> Enclosing(const Source& source, const std::vector<std::size_t>& faces,
                                      ProgressSink& progress) {
  const double checked = SecondsSince(source.start);
  std::vector<SimplifiedMesh> results(faces.size());
  std::map<double, std::vector<std::size_t>> runs;
  for (std::size_t i = 0; i < faces.size(); ++i)
    runs[WrapFor(source.parts, source.mesh.faces.size(), faces[i])].push_back(i);
  for (const auto& [inverse_gap, members] : runs) {
    const auto run_start = std::chrono::steady_clock::now();
    bool wrapped = inverse_gap > 0;
    Mesh wrap;
    if (wrapped) {
      Progress step(progress, "wrapping", 0);
      wrap = MakeManifold(TightWrap(source.mesh, source.size / inverse_gap, kOffsetPerGap * source.size / inverse_gap));
    }
    const Mesh& from = wrapped ? wrap : source.mesh;
    const MeshParts from_parts = wrapped ? CountParts(wrap) : source.parts;
    std::vector<std::size_t> wanted;
    for (const std::size_t i : members) {
      source.Require(from_parts, faces[i]);
      wanted.push_back(faces[i]);
    }
    double before = checked + SecondsSince(run_start);
    ProgressiveHullSummary summary;
    std::vector<KeptHull> made = KeepHull(from, wanted, progress, &summary);
    const bool all = std::ranges::all_of(made, [](const KeptHull& hull) { return hull.reached; });
    if (!wrapped && (!all || summary.fell_back) && source.mesh.faces.size() >= kLeastWrapped) {
      // The simplified mesh keeps too many faces, or runs through itself: a wrap does neither.
      wrapped = true;
      const double gap = source.size / kCoarsestGap;
      wrap = MakeManifold(TightWrap(source.mesh, gap, kOffsetPerGap * gap));
      before = checked + SecondsSince(run_start);
      made = KeepHull(wrap, wanted, progress, &summary);
    }
    for (std::size_t k = 0; k < members.size(); ++k)
      results[members[k]] = {.mesh = std::move(made[k].mesh),
                             .seconds = before + made[k].seconds,
                             .reached = made[k].reached,
                             .wrapped = wrapped,
                             .removed_parts = 0};
  }
  return results;
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

std::string FacesLeft(std::size_t faces, std::size_t wanted, SimplifyMethod method) {
  return fmt::format("warning: {} faces are left instead of {}: {}", faces, wanted,
                     method == SimplifyMethod::kInPixels ? "with fewer its parts and holes would lose their shape"
                                                         : "no edge may be collapsed any more");
}

std::vector<SimplifiedMesh> Simplify(const Mesh& input, const std::vector<std::size_t>& faces, SimplifyMethod method,
                                     ProgressSink& progress, const std::vector<ProxyView>& views) {
  for (const std::size_t n : faces)
    if (n < 1) throw UsageError("--faces must be at least 1");
  const Source source = MakeSource(input);
  switch (method) {
    case SimplifyMethod::kQuadric: return Nearest(source, faces, progress);
    case SimplifyMethod::kInPixels: return NearestInPixels(source, faces, progress, views);
    case SimplifyMethod::kKeepHull: break;
  }
  if (!source.IsClosed())
    throw DataError("the mesh is open: only a closed one has an inside to keep", "simplify it without --keep-hull");
  return Enclosing(source, faces, progress);
}

}  // namespace lumi
