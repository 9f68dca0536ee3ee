// Where a ray's point lies for photo j of a RelativeSources: what measures ask of it (measures/record.h), in float, for
// loops over photos. Members are read through plain pointers and nothing is computed that is not asked for, so that
// such a loop vectorises.
#pragma once

#include <Eigen/Core>

#include "render/radiance/measures/angle.h"
#include "render/radiance/measures/field_of_view.h"
#include "render/radiance/measures/resolution.h"
#include "render/radiance/settings.h"
#include "render/radiance/sources.h"

namespace lumi {

// The ray, in the view's own terms.
struct RayPoint {
  float dx = 0, dy = 0, dz = 1, t = 1;  // unit direction, distance
  float x = 0, y = 0, z = 1;            // t times it
  float focal_px = 1;                   // of the view
  float dt_s = 0;                       // the view's time less the sources' origin, on the circle of a period already
  // For the stretch by Jacobian: tangents of the proxy's plane, and the image in the view of a step along each. A step
  // is as long as the point is deep, because areas for unit steps would underflow at far points.
  float e1[3] = {}, e2[3] = {};
  float depth = 1;
  float v00 = 0, v01 = 0, v10 = 0, v11 = 0;
};
RayPoint PointOfRay(const RelativeSources& sources, const RadianceSettings& settings, const Eigen::Vector3f& direction,
                    float t, const Eigen::Vector3f& normal);

// A RelativeSources's arrays.
struct PhotoArrays {
  explicit PhotoArrays(const RelativeSources& r)
      : Dx(r.dx.data()),
        Dy(r.dy.data()),
        Dz(r.dz.data()),
        width(r.width_px.data()),
        height(r.height_px.data()),
        feather(r.feather_px.data()),
        enabled(r.enabled.data()),
        focal(r.focal_px.data()),
        dt(r.dt_s.data()),
        timed(r.timed.data()),
        view(r.view.data()) {
    for (int i = 0; i < 9; ++i) m[i] = r.m[i].data();
  }
  const float *Dx, *Dy, *Dz, *width, *height, *feather, *enabled, *focal, *dt, *timed;
  const std::int32_t* view;
  const float* m[9];
};

// Place of the point in a photo: px, and depth along its axis.
struct PlaceInPhoto {
  float u, v, w;
};
LUMI_INLINE PlaceInPhoto PlaceOf(const PhotoArrays& a, const RayPoint& p, int j) {
  const float x = p.x - a.Dx[j], y = p.y - a.Dy[j], z = p.z - a.Dz[j];
  const float w = a.m[6][j] * x + a.m[7][j] * y + a.m[8][j] * z;
  const float iw = 1.0F / (w > 0 ? w : 1.0F);
  return {(a.m[0][j] * x + a.m[1][j] * y + a.m[2][j] * z) * iw, (a.m[3][j] * x + a.m[4][j] * y + a.m[5][j] * z) * iw,
          w};
}

// 0 where the photo does not contain the point, or is left out.
LUMI_INLINE float FieldOfViewOf(const PhotoArrays& a, const RayPoint& p, int j) {
  const PlaceInPhoto x = PlaceOf(a, p, j);
  const float edge = std::min(std::min(x.u, a.width[j] - x.u), std::min(x.v, a.height[j] - x.v));
  const bool seen = (x.w > 0) & (edge >= 0) & (a.enabled[j] > 0);
  // A product, not a conditional: that would become a branch, which prevents vectorisation.
  const float inside = FieldOfView(edge, a.feather[j]), counts = seen ? 1.0F : 0.0F;
  return (inside > kBarelySeen ? inside : kBarelySeen) * counts;
}

// A PhotoField's number at a place in its photo, px; `cells`: the photo's own.
LUMI_INLINE float FieldAt(const float* cells, int columns, int rows, float u, float v, float width, float height) {
  const float x =
      std::min(std::max(0.0F, u / width * static_cast<float>(columns) - 0.5F), static_cast<float>(columns - 1));
  const float y = std::min(std::max(0.0F, v / height * static_cast<float>(rows) - 0.5F), static_cast<float>(rows - 1));
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y), x1 = std::min(x0 + 1, columns - 1),
            y1 = std::min(y0 + 1, rows - 1);
  const float ax = x - static_cast<float>(x0), ay = y - static_cast<float>(y0);
  const float top = (1 - ax) * cells[y0 * columns + x0] + ax * cells[y0 * columns + x1];
  const float bottom = (1 - ax) * cells[y1 * columns + x0] + ax * cells[y1 * columns + x1];
  return (1 - ay) * top + ay * bottom;
}

template <Resolution kStretch>
struct PhotoSight {
  const PhotoArrays& a;
  const RayPoint& p;
  int j;
  const PhotoField* of = nullptr;  // the measure's; read by field()

  LUMI_INLINE float theta() const { return Angle(a.Dx[j], a.Dy[j], a.Dz[j], p.dx, p.dy, p.dz, p.t); }
  LUMI_INLINE float u() const { return PlaceOf(a, p, j).u; }
  LUMI_INLINE float v() const { return PlaceOf(a, p, j).v; }
  LUMI_INLINE float w() const { return PlaceOf(a, p, j).w; }
  LUMI_INLINE float width() const { return a.width[j]; }
  LUMI_INLINE float height() const { return a.height[j]; }
  LUMI_INLINE float field() const {
    const PlaceInPhoto x = PlaceOf(a, p, j);
    const int view = of->value.empty() ? 0 : std::max(a.view[j], 0);
    return FieldAt(of->Of(0).data() + view * of->columns * of->rows, of->columns, of->rows, x.u, x.v, a.width[j],
                   a.height[j]);
  }
  LUMI_INLINE float timed() const { return a.timed[j]; }
  LUMI_INLINE float dt_s() const { return a.dt[j] - p.dt_s; }
  LUMI_INLINE float stretch() const {
    if constexpr (kStretch == Resolution::kDistance) {
      const float x = p.x - a.Dx[j], y = p.y - a.Dy[j], z = p.z - a.Dz[j];
      return DistanceStretch(std::sqrt(x * x + y * y + z * z), p.t, a.focal[j], p.focal_px);
    } else {
      const auto [u, v, w] = PlaceOf(a, p, j);
      const float step = p.depth / (w > 0 ? w : 1.0F);
      const float a0 = a.m[0][j] - u * a.m[6][j], a1 = a.m[1][j] - u * a.m[7][j], a2 = a.m[2][j] - u * a.m[8][j];
      const float b0 = a.m[3][j] - v * a.m[6][j], b1 = a.m[4][j] - v * a.m[7][j], b2 = a.m[5][j] - v * a.m[8][j];
      const float sigma = JacobianStretch(
          p.v00, p.v01, p.v10, p.v11,  //
          (a0 * p.e1[0] + a1 * p.e1[1] + a2 * p.e1[2]) * step, (a0 * p.e2[0] + a1 * p.e2[1] + a2 * p.e2[2]) * step,
          (b0 * p.e1[0] + b1 * p.e1[1] + b2 * p.e1[2]) * step, (b0 * p.e2[0] + b1 * p.e2[1] + b2 * p.e2[2]) * step);
      return w > 0 ? sigma : 1e12F;
    }
  }
};

}  // namespace lumi
