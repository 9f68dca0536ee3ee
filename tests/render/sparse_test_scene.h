// What the tests of the sparse plans share.
#pragma once

#include <cmath>

#include "capture.h"
#include "render/radiance/sparse/raster.h"
#include "render/radiance/sparse/sparse_plan.h"
#include "render/world/renderer.h"

namespace lumi::test {

// A loop that is not parallel.
inline void InTurn(std::size_t count, std::size_t, const std::function<void(std::size_t, std::size_t)>& body) {
  body(0, count);
}

inline RenderRequest SparseRequest(const RenderView& view, int k, int grid, Sampling sampling) {
  RenderRequest r;
  r.view = view;
  r.settings.k = k;
  r.settings.grid_columns = r.settings.grid_rows = grid;
  r.settings.sampling = sampling;
  return r;
}

inline RenderView ViewOf(const Capture& c, const Eigen::Vector3d& eye, const Eigen::Vector3d& at = {0, 0, 0.5}) {
  return MakeRenderView(c.scene.cameras[0], LookAt(eye, at, {0, -1, 0}));
}

// A bumpy sheet of n x n squares at about z = 1: a proxy of many facets.
inline Mesh Sheet(int n) {
  Mesh m;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x) {
      const double u = 6.0 * x / n - 3, v = 6.0 * y / n - 3;
      m.vertices.emplace_back(u, v, 1 + 0.25 * std::sin(2 * u) * std::cos(1.7 * v));
    }
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const int a = y * (n + 1) + x;
      m.faces.push_back({a, a + 1, a + n + 2});
      m.faces.push_back({a, a + n + 2, a + n + 1});
    }
  return m;
}

// What is wrong with a picture: numbers that are none, alpha outside [0,1], colours beyond alpha. Empty: nothing.
inline std::string Wrong(const ImageF& image) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const float a = image.At(x, y, 3);
      bool good = std::isfinite(a) && a >= 0 && a <= 1;
      for (int c = 0; c < 3; ++c)
        good = good && std::isfinite(image.At(x, y, c)) && image.At(x, y, c) >= 0 && image.At(x, y, c) <= a + 1e-3F;
      if (!good)
        return "pixel " + std::to_string(x) + ", " + std::to_string(y) + ": " + std::to_string(image.At(x, y, 0)) +
               " " + std::to_string(image.At(x, y, 1)) + " " + std::to_string(image.At(x, y, 2)) + " " +
               std::to_string(a);
    }
  return {};
}

// What is wrong with a plan's numbers; weights at corners lie in [0,1] and sum to 1 or to 0.
inline std::string Wrong(const SparsePlan& plan) {
  for (std::size_t v = 0; v < plan.x_px.size(); ++v)
    if (!plan.x_px[v].allFinite() || !plan.offset[v].allFinite() || !plan.normal[v].allFinite() ||
        !(plan.alpha[v] >= 0 && plan.alpha[v] <= 1))
      return "vertex " + std::to_string(v);
  for (std::size_t t = 0; t < plan.triangles.size(); ++t) {
    const SparseTriangle& s = plan.triangles[t];
    for (std::size_t i = 0; i < 3; ++i) {
      float sum = 0;
      for (auto e = static_cast<std::size_t>(s.first); e < static_cast<std::size_t>(s.first + s.count); ++e) {
        const float w = plan.weight[e][i];
        if (!(w >= 0 && w <= 1 + 1e-6F))
          return "a weight of triangle " + std::to_string(t) + " is " + std::to_string(w);
        sum += w;
      }
      if (std::abs(sum - (plan.alpha[static_cast<std::size_t>(s.vertex[i])] > 0 ? 1.0F : 0.0F)) > 1e-5F)
        return "weights at a corner of triangle " + std::to_string(t) + " sum to " + std::to_string(sum);
    }
  }
  return {};
}

}  // namespace lumi::test
