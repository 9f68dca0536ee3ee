#include "render/radiance/measures.h"

#include <cmath>

#include "render/radiance/kernel.h"
#include "render/radiance/measures/angle.h"
#include "render/radiance/measures/field_of_view.h"
#include "render/radiance/measures/resolution.h"
#include "render/radiance/measures/time.h"

namespace lumi {
namespace {

LUMI_KERNEL void Angles(const RelativeSources& r, float dirx, float diry, float dirz, float t, float* __restrict theta) {
  const float* __restrict dx = r.dx.data();
  const float* __restrict dy = r.dy.data();
  const float* __restrict dz = r.dz.data();
  for (int j = 0; j < r.padded; ++j) theta[j] = Angle(dx[j], dy[j], dz[j], dirx, diry, dirz, t);
}

LUMI_KERNEL void FieldsOfView(const RelativeSources& r, float x, float y, float z, float* __restrict f_out) {
  const float* __restrict dx = r.dx.data();
  const float* __restrict dy = r.dy.data();
  const float* __restrict dz = r.dz.data();
  const float* __restrict m0 = r.m[0].data();
  const float* __restrict m1 = r.m[1].data();
  const float* __restrict m2 = r.m[2].data();
  const float* __restrict m3 = r.m[3].data();
  const float* __restrict m4 = r.m[4].data();
  const float* __restrict m5 = r.m[5].data();
  const float* __restrict m6 = r.m[6].data();
  const float* __restrict m7 = r.m[7].data();
  const float* __restrict m8 = r.m[8].data();
  const float* __restrict width = r.width_px.data();
  const float* __restrict height = r.height_px.data();
  const float* __restrict feather = r.feather_px.data();
  const float* __restrict enabled = r.enabled.data();
  for (int j = 0; j < r.padded; ++j) {
    const float px = x - dx[j], py = y - dy[j], pz = z - dz[j];
    const float w = m6[j] * px + m7[j] * py + m8[j] * pz;
    const float iw = 1.0F / (w > 0 ? w : 1.0F);
    const float u = (m0[j] * px + m1[j] * py + m2[j] * pz) * iw;
    const float v = (m3[j] * px + m4[j] * py + m5[j] * pz) * iw;
    const float edge = std::min(std::min(u, width[j] - u), std::min(v, height[j] - v));
    const bool seen = (w > 0) & (edge >= 0) & (enabled[j] > 0);
    f_out[j] = seen ? std::max(FieldOfView(edge, feather[j]), kBarelySeen) : 0.0F;
  }
}

LUMI_KERNEL void DistanceResolution(const RelativeSources& r, float x, float y, float z, float t, float inverse_log_low,
                                    float inverse_log_high, float* __restrict r_out) {
  const float* __restrict dx = r.dx.data();
  const float* __restrict dy = r.dy.data();
  const float* __restrict dz = r.dz.data();
  const float* __restrict focal = r.focal_px.data();
  const float desired_focal = r.desired_focal_px;
  for (int j = 0; j < r.padded; ++j) {
    const float px = x - dx[j], py = y - dy[j], pz = z - dz[j];
    const float distance = std::sqrt(px * px + py * py + pz * pz);
    r_out[j] = ResolutionValue(DistanceStretch(distance, t, focal[j], desired_focal), inverse_log_low, inverse_log_high);
  }
}

// The proxy's plane at the point, as the desired view sees it: tangents, and the image of a step along each, as long as the point is
// deep: sigma is a ratio of areas, and those of far points would underflow.
struct Facet {
  float e1[3], e2[3];
  float depth;
  float v00, v01, v10, v11;
};

LUMI_KERNEL void JacobianResolution(const RelativeSources& r, float x, float y, float z, const Facet& facet, float inverse_log_low,
                                    float inverse_log_high, float* __restrict r_out) {
  const float* __restrict dx = r.dx.data();
  const float* __restrict dy = r.dy.data();
  const float* __restrict dz = r.dz.data();
  const float* __restrict m0 = r.m[0].data();
  const float* __restrict m1 = r.m[1].data();
  const float* __restrict m2 = r.m[2].data();
  const float* __restrict m3 = r.m[3].data();
  const float* __restrict m4 = r.m[4].data();
  const float* __restrict m5 = r.m[5].data();
  const float* __restrict m6 = r.m[6].data();
  const float* __restrict m7 = r.m[7].data();
  const float* __restrict m8 = r.m[8].data();
  const Facet c = facet;
  for (int j = 0; j < r.padded; ++j) {
    const float px = x - dx[j], py = y - dy[j], pz = z - dz[j];
    const float w = m6[j] * px + m7[j] * py + m8[j] * pz;
    const float iw = 1.0F / (w > 0 ? w : 1.0F);
    const float u = (m0[j] * px + m1[j] * py + m2[j] * pz) * iw;
    const float v = (m3[j] * px + m4[j] * py + m5[j] * pz) * iw;
    const float step = c.depth * iw;
    const float a0 = m0[j] - u * m6[j], a1 = m1[j] - u * m7[j], a2 = m2[j] - u * m8[j];
    const float b0 = m3[j] - v * m6[j], b1 = m4[j] - v * m7[j], b2 = m5[j] - v * m8[j];
    const float sigma = JacobianStretch(c.v00, c.v01, c.v10, c.v11,                                                          //
                                        (a0 * c.e1[0] + a1 * c.e1[1] + a2 * c.e1[2]) * step, (a0 * c.e2[0] + a1 * c.e2[1] + a2 * c.e2[2]) * step,
                                        (b0 * c.e1[0] + b1 * c.e1[1] + b2 * c.e1[2]) * step, (b0 * c.e2[0] + b1 * c.e2[1] + b2 * c.e2[2]) * step);
    const float value = ResolutionValue(sigma, inverse_log_low, inverse_log_high);
    r_out[j] = w > 0 ? value : 0.0F;
  }
}

LUMI_KERNEL void Times(const RelativeSources& r, float dt_s, const TimeShape& shape, float* __restrict tau) {
  const TimeShape here = shape;
  const float* __restrict dt = r.dt_s.data();
  const float* __restrict timed = r.timed.data();
  for (int j = 0; j < r.padded; ++j) tau[j] = timed[j] * TimeDissimilarity(dt[j] - dt_s, here);
}

Facet FacetAt(const RelativeSources& r, const Eigen::Vector3f& p, const Eigen::Vector3f& normal) {
  Facet f{};
  // Any tangents serve: a rotation of them changes no singular value.
  const Eigen::Vector3f n = normal.squaredNorm() > 0 ? normal.normalized() : p.normalized();
  const Eigen::Vector3f e1 = n.unitOrthogonal(), e2 = n.cross(e1);
  Eigen::Map<Eigen::Vector3f>(f.e1) = e1;
  Eigen::Map<Eigen::Vector3f>(f.e2) = e2;
  const Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> M(r.desired_m);
  const Eigen::Vector3f q = M * p;
  f.depth = q.z() > 0 ? q.z() : 1;
  const Eigen::RowVector3f a = M.row(0) - q.x() / f.depth * M.row(2), b = M.row(1) - q.y() / f.depth * M.row(2);
  f.v00 = a.dot(e1);
  f.v01 = a.dot(e2);
  f.v10 = b.dot(e1);
  f.v11 = b.dot(e2);
  return f;
}

}  // namespace

void EvaluateMeasures(const RelativeSources& sources, const RadianceSettings& settings, const Eigen::Vector3f& d, float t,
                      const Eigen::Vector3f& normal, Measures& out) {
  const auto n = static_cast<std::size_t>(sources.padded);
  const Eigen::Vector3f p = t * d;
  out.theta.resize(n);
  out.f.resize(n);
  Angles(sources, d.x(), d.y(), d.z(), t, out.theta.data());
  if (settings.field_of_view)
    FieldsOfView(sources, p.x(), p.y(), p.z(), out.f.data());
  else
    out.f = sources.enabled;
  const float low = InverseLog(settings.resolution_low), high = InverseLog(settings.resolution_high);
  if (settings.resolution != Resolution::kOff) out.r.resize(n);
  if (settings.resolution == Resolution::kDistance) DistanceResolution(sources, p.x(), p.y(), p.z(), t, low, high, out.r.data());
  if (settings.resolution == Resolution::kJacobian)
    JacobianResolution(sources, p.x(), p.y(), p.z(), FacetAt(sources, p, normal), low, high, out.r.data());
  if (settings.time) {
    out.tau.resize(n);
    // The difference in double, on the circle already: a video's times run into hours, a period into fractions of a second.
    double dt = settings.time_s - sources.time_origin_s;
    if (settings.period_s > 0) dt = std::remainder(dt, settings.period_s);
    // Bounded: no difference in time times infinity is no number, and h must not overflow.
    constexpr double kMost = 1e18;
    TimeShape shape;
    shape.inverse_half_window = static_cast<float>(std::min(2 / settings.time_window_s, kMost));
    shape.core = static_cast<float>(settings.time_core);
    shape.least = static_cast<float>(settings.time_least);
    shape.period_s = static_cast<float>(settings.period_s);
    shape.inverse_period = settings.period_s > 0 ? static_cast<float>(std::min(1 / settings.period_s, kMost)) : 0.0F;
    Times(sources, static_cast<float>(dt), shape, out.tau.data());
  }
}

void EvaluateVisibility(const RelativeSources& r, const VisibilityMaps* maps, const Eigen::Vector3f& direction, float t, Measures& out) {
  out.v.assign(static_cast<std::size_t>(r.padded), 1.0F);
  if (!maps || maps->empty()) return;
  const Eigen::Vector3f p = t * direction;
  for (std::size_t j = 0; j < static_cast<std::size_t>(r.count); ++j) {
    if (!(out.f[j] > 0)) continue;
    const float x = p.x() - r.dx[j], y = p.y() - r.dy[j], z = p.z() - r.dz[j];
    const float w = r.m[6][j] * x + r.m[7][j] * y + r.m[8][j] * z;
    if (!(w > 0)) continue;
    const float u = (r.m[0][j] * x + r.m[1][j] * y + r.m[2][j] * z) / w, v = (r.m[3][j] * x + r.m[4][j] * y + r.m[5][j] * z) / w;
    out.v[j] = maps->Visibility(r.view[j], u, v, r.width_px[j], r.height_px[j], w);
  }
}

}  // namespace lumi
