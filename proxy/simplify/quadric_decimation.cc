#include "proxy/simplify/quadric_decimation.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModBaseT.hh>
#include <OpenMesh/Tools/Decimater/Observer.hh>

#include <Eigen/LU>
#include <numeric>
#include <stdexcept>

#include "proxy/simplify/collapse_rules.h"
#include "proxy/simplify/mesh_topology.h"
#include "scene/geometry/median.h"
#include "scene/program/stopwatch.h"

namespace lumi {
namespace {

using Eigen::Vector3d;

struct DecimationTraits : OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
};
using DecimationMesh = OpenMesh::TriMesh_ArrayKernelT<DecimationTraits>;

Vector3d ToEigen(const OpenMesh::Vec3d& x) { return {x[0], x[1], x[2]}; }

// An upright border weighs as much as a surface so many times as wide as the border's edges are long.
constexpr double kBorderWeight = 10;
// Where all is flat the shorter edge goes first; slopes of a thousandth count more.
constexpr double kLengthWeight = 1e-6;
// Keeps a vertex where its planes do not say where it belongs, along a crease or amid a flat patch. Of the quadric's
// trace.
constexpr double kStay = 1e-3;

// Sum of squared distances from planes, weighted: x' A x + 2 b' x + c.
struct Quadric {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  double c = 0;
  void AddPlane(const Vector3d& unit_normal, const Vector3d& through, double weight) {
    const double d = -unit_normal.dot(through);
    A += weight * unit_normal * unit_normal.transpose();
    b += weight * d * unit_normal;
    c += weight * d * d;
  }
  void Add(const Quadric& o) {
    A += o.A;
    b += o.b;
    c += o.c;
  }
  double At(const Vector3d& x) const { return x.dot(A * x) + 2 * b.dot(x) + c; }
};

class SoundDecimater : public OpenMesh::Decimater::DecimaterT<DecimationMesh> {
 public:
  explicit SoundDecimater(DecimationMesh& mesh) : BaseDecimaterT(mesh), DecimaterT(mesh) {}
  using DecimaterT::is_collapse_legal;
};

// The order in which vertices go, and which collapses are sound.
class QuadricModule : public OpenMesh::Decimater::ModBaseT<DecimationMesh> {
 public:
  using Handle = OpenMesh::Decimater::ModHandleT<QuadricModule>;
  using Base = OpenMesh::Decimater::ModBaseT<DecimationMesh>;
  using CollapseInfo = Base::CollapseInfo;
  const std::string& name() const override {
    static const std::string own = "QuadricWithBorders";
    return own;
  }

  explicit QuadricModule(DecimationMesh& mesh) : Base(mesh, false) {
    mesh.add_property(quadrics_);
    mesh.add_property(length_weights_);
  }
  ~QuadricModule() override {
    mesh().remove_property(quadrics_);
    mesh().remove_property(length_weights_);
  }
  // Of each face, before initialize(): squared distances times areas grow with its fourth power.
  void SetScale(std::vector<double> scale) { scale_ = std::move(scale); }
  const Quadric& Of(DecimationMesh::VertexHandle v) { return mesh().property(quadrics_, v); }

  void initialize() override {
    for (const auto v : mesh().vertices()) mesh().property(length_weights_, v) = 0;
    for (const auto f : mesh().faces()) {
      const double s = scale_.empty() ? 1 : scale_[static_cast<std::size_t>(f.idx())];
      const double scale4 = s * s * s * s;
      auto fv = mesh().cfv_iter(f);
      const auto a = *fv++, b = *fv++, c = *fv;
      for (const auto v : {a, b, c}) {
        double& largest = mesh().property(length_weights_, v);
        largest = std::max(largest, kLengthWeight * scale4);
      }
      const TriangleShape shape = ShapeOf(ToEigen(mesh().point(a)), ToEigen(mesh().point(b)), ToEigen(mesh().point(c)));
      if (shape.quality < kDegenerateQuality) continue;
      const Vector3d normal = shape.area_vector / shape.area2;
      for (const auto v : {a, b, c})
        mesh().property(quadrics_, v).AddPlane(normal, ToEigen(mesh().point(a)), scale4 * shape.area2 / 6);
      for (const auto h : mesh().fh_range(f)) {
        if (!mesh().is_boundary(mesh().opposite_halfedge_handle(h))) continue;
        const auto from = mesh().from_vertex_handle(h), to = mesh().to_vertex_handle(h);
        const Vector3d along = ToEigen(mesh().point(to)) - ToEigen(mesh().point(from));
        const double length = along.norm();
        if (!(length > 0)) continue;
        for (const auto v : {from, to})
          mesh()
              .property(quadrics_, v)
              .AddPlane(along.cross(normal) / length, ToEigen(mesh().point(from)),
                        scale4 * kBorderWeight * length * length);
      }
    }
  }

  float collapse_priority(const CollapseInfo& c) override {
    double worst_before = 1, worst_after = 1;
    for (const auto f : mesh().vf_range(c.v0)) {
      std::array<Vector3d, 3> corners;
      std::array<bool, 3> moves = {};
      std::size_t k = 0;
      for (const auto v : mesh().fv_range(f)) {
        moves[k] = v == c.v0;
        corners[k++] = ToEigen(mesh().point(v));
      }
      const TriangleShape before = ShapeOf(corners[0], corners[1], corners[2]);
      worst_before = std::min(worst_before, before.quality);
      if (f == c.fl || f == c.fr) continue;
      for (k = 0; k < 3; ++k)
        if (moves[k]) corners[k] = ToEigen(c.p1);
      const TriangleShape after = ShapeOf(corners[0], corners[1], corners[2]);
      worst_after = std::min(worst_after, after.quality);
      if (before.quality < kDegenerateQuality) continue;
      if (after.quality < kDegenerateQuality) return float(Base::ILLEGAL_COLLAPSE);
      if (before.area_vector.dot(after.area_vector) < kLeastTurnCosine * before.area2 * after.area2)
        return float(Base::ILLEGAL_COLLAPSE);
    }
    if (worst_after < std::min(kLeastQuality, worst_before)) return float(Base::ILLEGAL_COLLAPSE);
    Quadric q = Of(c.v0);
    q.Add(Of(c.v1));
    const double length2 = (c.p1 - c.p0).sqrnorm();
    // Times a power of two: of a mesh about 1 across the errors of small faces would be lost below float's range.
    const double length_weight = std::max(LengthWeight(c.v0), LengthWeight(c.v1));
    return static_cast<float>((std::max(0.0, q.At(ToEigen(c.p1))) + length_weight * length2 * length2) * 0x1p60);
  }

  void postprocess_collapse(const CollapseInfo& c) override {
    mesh().property(quadrics_, c.v1).Add(Of(c.v0));
    mesh().property(length_weights_, c.v1) = std::max(LengthWeight(c.v0), LengthWeight(c.v1));
  }

 private:
  double LengthWeight(DecimationMesh::VertexHandle v) { return mesh().property(length_weights_, v); }

  std::vector<double> scale_;
  OpenMesh::VPropHandleT<Quadric> quadrics_;
  OpenMesh::VPropHandleT<double> length_weights_;
};

class StepObserver : public OpenMesh::Decimater::Observer {
 public:
  explicit StepObserver(Progress& steps) : Observer(kEvery), steps_(steps) {}
  void notify(std::size_t) override { steps_.Step(kEvery); }

 private:
  static constexpr long kEvery = 256;
  Progress& steps_;
};

// Where the quadric is least, as far as the faces around allow.
void Refit(Mesh& mesh, const std::vector<Quadric>& quadrics) {
  std::vector<std::vector<std::size_t>> around(mesh.vertices.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f)
    for (const std::int32_t v : mesh.faces[f]) around[static_cast<std::size_t>(v)].push_back(f);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const Quadric& q = quadrics[v];
    const double stay = kStay * q.A.trace();
    if (!(stay > 0)) continue;
    const Vector3d old = mesh.vertices[v];
    const Vector3d step = -(q.A + stay * Eigen::Matrix3d::Identity()).inverse() * (q.A * old + q.b);
    for (const double share : {1.0, 0.5}) {
      const Vector3d moved = old + share * step;
      bool sound = moved.allFinite() && q.At(moved) < q.At(old);
      double worst_before = 1, worst_after = 1;
      for (const std::size_t f : around[v]) {
        if (!sound) break;
        std::array<Vector3d, 3> corners;
        for (std::size_t k = 0; k < 3; ++k) corners[k] = mesh.vertices[static_cast<std::size_t>(mesh.faces[f][k])];
        const TriangleShape before = ShapeOf(corners[0], corners[1], corners[2]);
        for (std::size_t k = 0; k < 3; ++k)
          if (static_cast<std::size_t>(mesh.faces[f][k]) == v) corners[k] = moved;
        const TriangleShape after = ShapeOf(corners[0], corners[1], corners[2]);
        worst_before = std::min(worst_before, before.quality);
        worst_after = std::min(worst_after, after.quality);
        sound = after.quality >= kDegenerateQuality &&
                before.area_vector.dot(after.area_vector) >= kLeastTurnCosine * before.area2 * after.area2;
      }
      if (!sound || worst_after < std::min(kLeastQuality, worst_before)) continue;
      mesh.vertices[v] = moved;
      break;
    }
  }
}

// Collapses the shortest side of faces without area, whose planes mean nothing.
void RemoveDegenerateFaces(DecimationMesh& mesh, SoundDecimater& decimater, QuadricModule& module) {
  for (bool more = true; more;) {
    more = false;
    for (const auto f : mesh.faces()) {
      if (mesh.status(f).deleted()) continue;
      auto fv = mesh.cfv_iter(f);
      const auto a = *fv++, b = *fv++, c = *fv;
      if (ShapeOf(ToEigen(mesh.point(a)), ToEigen(mesh.point(b)), ToEigen(mesh.point(c))).quality >= kDegenerateQuality)
        continue;
      DecimationMesh::HalfedgeHandle best;
      double shortest = 0;
      for (const auto h : mesh.fh_range(f)) {
        for (const DecimationMesh::HalfedgeHandle side :
             {DecimationMesh::HalfedgeHandle(h), DecimationMesh::HalfedgeHandle(mesh.opposite_halfedge_handle(h))}) {
          OpenMesh::Decimater::CollapseInfoT<DecimationMesh> info(mesh, side);
          const double length = (info.p0 - info.p1).norm();
          if ((best.is_valid() && length >= shortest) || !decimater.is_collapse_legal(info) ||
              module.collapse_priority(info) < 0)
            continue;
          best = side;
          shortest = length;
        }
      }
      if (!best.is_valid()) continue;
      OpenMesh::Decimater::CollapseInfoT<DecimationMesh> info(mesh, best);
      mesh.collapse(best);
      module.postprocess_collapse(info);
      more = true;
    }
  }
  mesh.garbage_collection();
}

}  // namespace

// About 1, so that errors stay where floats have digits.
static std::vector<double> Normalised(std::vector<double> scale) {
  if (scale.empty()) return scale;
  const double median = Median(scale);
  for (double& s : scale) s /= median;
  return scale;
}

std::vector<DecimatedMesh> Decimate(const Mesh& input, const std::vector<std::size_t>& faces, ProgressSink& progress,
                                    const std::vector<double>& scale) {
  const Stopwatch watch;
  const NormalisedFrame frame(input);
  DecimationMesh mesh;
  mesh.reserve(input.vertices.size(), input.faces.size() * 3 / 2, input.faces.size());
  for (const Vector3d& v : input.vertices) {
    const Vector3d x = frame.ToLocal(v);
    mesh.add_vertex({x.x(), x.y(), x.z()});
  }
  for (const auto& f : input.faces)
    if (!mesh.add_face(OpenMesh::VertexHandle(f[0]), OpenMesh::VertexHandle(f[1]), OpenMesh::VertexHandle(f[2]))
             .is_valid())
      throw std::invalid_argument("Decimate: the mesh is no oriented 2-manifold");

  SoundDecimater decimater(mesh);
  QuadricModule::Handle handle;
  decimater.add(handle);
  QuadricModule& module = decimater.module(handle);
  module.SetScale(Normalised(scale));
  if (!decimater.initialize()) throw std::logic_error("Decimate: no priority module");
  RemoveDegenerateFaces(mesh, decimater, module);

  std::vector<std::size_t> order(faces.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, [&](std::size_t i, std::size_t j) { return faces[i] > faces[j]; });
  const std::size_t least = faces.empty() ? 0 : faces[order.back()];
  Progress steps(progress, "decimating", mesh.n_faces() > least ? static_cast<long>((mesh.n_faces() - least) / 2) : 0);
  StepObserver observer(steps);
  decimater.set_observer(&observer);
  std::vector<DecimatedMesh> results(faces.size());
  for (const std::size_t i : order) {
    if (mesh.n_faces() > faces[i]) {
      decimater.decimate_to_faces(0, faces[i]);
      mesh.garbage_collection();
    }
    DecimatedMesh& result = results[i];
    std::vector<Quadric> quadrics;
    std::vector<std::int32_t> name(mesh.n_vertices(), -1);
    for (const auto f : mesh.faces()) {
      std::array<std::int32_t, 3> face;
      std::size_t k = 0;
      for (const auto v : mesh.fv_range(f)) {
        std::int32_t& n = name[static_cast<std::size_t>(v.idx())];
        if (n < 0) {
          n = static_cast<std::int32_t>(result.mesh.vertices.size());
          result.mesh.vertices.push_back(ToEigen(mesh.point(v)));
          quadrics.push_back(module.Of(v));
        }
        face[k++] = n;
      }
      result.mesh.faces.push_back(face);
    }
    if (mesh.n_faces() < input.faces.size()) Refit(result.mesh, quadrics);
    for (Vector3d& v : result.mesh.vertices) v = frame.ToWorld(v);
    result.reached = mesh.n_faces() <= faces[i];
    result.seconds = watch.Seconds();
  }
  return results;
}

}  // namespace lumi
