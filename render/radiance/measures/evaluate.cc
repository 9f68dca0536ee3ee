#include "render/radiance/measures/evaluate.h"

#include <algorithm>
#include <cmath>

#include "render/radiance/dissimilarity.h"
#include "render/radiance/kernel.h"
#include "render/radiance/measures/photo_sight.h"

namespace lumi {
namespace {

LUMI_KERNEL void Angles(const RelativeSources& r, const RayPoint& point, float* __restrict theta) {
  const PhotoArrays a(r);
  const RayPoint p = point;
  for (int j = 0; j < r.padded; ++j) theta[j] = PhotoSight<Resolution::kOff>{a, p, j}.theta();
}

LUMI_KERNEL void FieldsOfView(const RelativeSources& r, const RayPoint& point, float* __restrict f_out) {
  const PhotoArrays a(r);
  const RayPoint p = point;
  for (int j = 0; j < r.padded; ++j) f_out[j] = FieldOfViewOf(a, p, j);
}

// A term's values, and what they add to h.
template <typename M, Resolution kStretch>
LUMI_KERNEL void AddTerm(const RelativeSources& r, const RayPoint& point, const typename M::Shape& given, float scale,
                         float* __restrict value, float* __restrict terms) {
  const PhotoArrays a(r);
  const RayPoint p = point;
  const typename M::Shape shape = given;
  const PhotoField* field = &(*r.fields)[MeasureList::IndexOf<M>()];
  for (int j = 0; j < r.padded; ++j) {
    value[j] = M::Value(PhotoSight<kStretch>{a, p, j, field}, shape);
    terms[j] = WithTerm(terms[j], scale, static_cast<float>(M::kOwn), value[j]);
  }
}

template <typename M>
void AddTerm(const RelativeSources& sources, const RadianceSettings& settings, const RayPoint& point, Measures& out) {
  const auto n = static_cast<std::size_t>(sources.padded);
  if (out.terms.empty()) out.terms.assign(n, 0.0F);
  std::vector<float>& value = out.value[static_cast<std::size_t>(MeasureList::IndexOf<M>())];
  value.resize(n);
  const auto scale = static_cast<float>(M::Factor(settings) * 2 * settings.r_max_rad);
  const auto shape = M::ShapeOf(settings);
  if (settings.resolution == Resolution::kJacobian)
    AddTerm<M, Resolution::kJacobian>(sources, point, shape, scale, value.data(), out.terms.data());
  else
    AddTerm<M, Resolution::kDistance>(sources, point, shape, scale, value.data(), out.terms.data());
}

}  // namespace

RayPoint PointOfRay(const RelativeSources& r, const RadianceSettings& settings, const Eigen::Vector3f& d, float t,
                    const Eigen::Vector3f& normal) {
  RayPoint p;
  p.dx = d.x();
  p.dy = d.y();
  p.dz = d.z();
  p.t = t;
  p.x = t * d.x();
  p.y = t * d.y();
  p.z = t * d.z();
  p.focal_px = r.desired_focal_px;
  if (settings.time) {
    // The difference in double, on the circle already: a video's times run into hours, a period into fractions of a
    // second.
    double dt = settings.time_s - r.time_origin_s;
    if (settings.period_s > 0) dt = std::remainder(dt, settings.period_s);
    p.dt_s = static_cast<float>(dt);
  }
  if (settings.resolution != Resolution::kJacobian) return p;
  // Any tangents serve: a rotation of them changes no singular value.
  const Eigen::Vector3f at(p.x, p.y, p.z);
  const Eigen::Vector3f n = normal.squaredNorm() > 0 ? normal.normalized() : at.normalized();
  const Eigen::Vector3f e1 = n.unitOrthogonal(), e2 = n.cross(e1);
  Eigen::Map<Eigen::Vector3f>(p.e1) = e1;
  Eigen::Map<Eigen::Vector3f>(p.e2) = e2;
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> M(r.desired_m);
  const Eigen::Vector3f q = M * at;
  p.depth = q.z() > 0 ? q.z() : 1;
  const Eigen::RowVector3f a = M.row(0) - q.x() / p.depth * M.row(2), b = M.row(1) - q.y() / p.depth * M.row(2);
  p.v00 = a.dot(e1);
  p.v01 = a.dot(e2);
  p.v10 = b.dot(e1);
  p.v11 = b.dot(e2);
  return p;
}

bool HasTerms(const RadianceSettings& settings) {
  bool any = false;
  ForEachTerm([&]<typename M> { any = any || M::Factor(settings) > 0; });
  return any;
}

void EvaluateMeasures(const RelativeSources& sources, const RadianceSettings& settings, const Eigen::Vector3f& d,
                      float t, const Eigen::Vector3f& normal, Measures& out) {
  const auto n = static_cast<std::size_t>(sources.padded);
  const RayPoint point = PointOfRay(sources, settings, d, t, normal);
  out.theta.resize(n);
  out.f.resize(n);
  Angles(sources, point, out.theta.data());
  if (settings.field_of_view)
    FieldsOfView(sources, point, out.f.data());
  else
    out.f = sources.enabled;
  EvaluateTerms(sources, settings, point, out);
}

void EvaluateTerms(const RelativeSources& sources, const RadianceSettings& settings, const RayPoint& point,
                   Measures& out) {
  out.terms.clear();
  ForEachTerm([&]<typename M> {
    if (M::On(settings)) AddTerm<M>(sources, settings, point, out);
  });
}

void EvaluateVisibility(const RelativeSources& r, const VisibilityMaps* maps, const Eigen::Vector3f& direction, float t,
                        Measures& out) {
  out.v.assign(static_cast<std::size_t>(r.padded), 1.0F);
  if (!maps || maps->empty()) return;
  const PhotoArrays a(r);
  const RayPoint p = PointOfRay(r, {}, direction, t, Eigen::Vector3f::Zero());
  for (int j = 0; j < r.count; ++j) {
    const auto i = static_cast<std::size_t>(j);
    if (!(out.f[i] > 0)) continue;
    const auto [u, v, w] = PlaceOf(a, p, j);
    if (w > 0) out.v[i] = maps->Visibility(r.view[i], u, v, a.width[j], a.height[j], w);
  }
}

std::vector<float> PhotoTerms(const RelativeSources& sources, const RadianceSettings& settings) {
  // Of such a term, any ray tells.
  const RayPoint point = PointOfRay(sources, settings, Eigen::Vector3f::UnitZ(), 1.0F, Eigen::Vector3f::UnitZ());
  Measures m;
  ForEachTerm([&]<typename M> {
    if (M::kPerPhoto && M::Factor(settings) > 0) AddTerm<M>(sources, settings, point, m);
  });
  m.terms.resize(static_cast<std::size_t>(sources.padded), 0.0F);
  return m.terms;
}

}  // namespace lumi
