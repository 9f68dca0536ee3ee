#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "render/radiance/sparse/candidate_plan.h"
#include "render/radiance/sparse/constrained_delaunay.h"
#include "scene/program/parallel.h"
#include "sparse_test_scene.h"

namespace lumi {
namespace {

using test::InTurn;

SparsePlan PlanOf(const test::Capture& c, const RenderRequest& request) {
  SparsePlan plan;
  const ViewSetup setup = MakeViewSetup(MakeSources(c.scene), request.view, request.settings, request.use);
  PlanSparse(setup, SparseProxy(c.proxy, c.scene.normalized_from_world), nullptr, InTurn, plan);
  return plan;
}

// How many triangles' pixels each pixel is.
std::vector<int> Covered(const SparseGeometry& g, const Eigen::Vector2i& size) {
  std::vector<int> count(static_cast<std::size_t>(size.x() * size.y()), 0);
  for (const SparseTriangle& t : g.triangles) {
    const TriangleRows rows({g.x_px[static_cast<std::size_t>(t.vertex[0])],
                             g.x_px[static_cast<std::size_t>(t.vertex[1])],
                             g.x_px[static_cast<std::size_t>(t.vertex[2])]});
    const auto [low, high] = rows.Rows(size.y());
    for (int y = low; y < high; ++y) {
      const auto [x0, x1] = rows.Span(y, size.x());
      for (int x = x0; x < x1; ++x) ++count[static_cast<std::size_t>(y * size.x() + x)];
    }
  }
  return count;
}

std::vector<bool> Hit(const test::Capture& c, const RenderView& view) {
  const ViewSetup setup = MakeViewSetup(MakeSources(c.scene), view, {});
  std::vector<Eigen::Vector3f> rays;
  for (int y = 0; y < view.size_px.y(); ++y)
    for (int x = 0; x < view.size_px.x(); ++x)
      rays.push_back((setup.ray_from_pixel * Eigen::Vector3d(x + 0.5, y + 0.5, 1)).normalized().cast<float>());
  std::vector<float> t(rays.size());
  ProxyTracer(c.proxy, c.scene.normalized_from_world).Trace(setup.desired.centre.cast<float>(), rays, t);
  std::vector<bool> hit;
  for (const float d : t) hit.push_back(std::isfinite(d));
  return hit;
}

TEST(TriangulateConstrained, CrossingSegmentsGetAVertexAndPartTheirSides) {
  PlanarTriangulation t;
  const std::vector<Eigen::Vector2d> square{{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  const std::vector<std::array<Eigen::Vector2d, 2>> cross{{Eigen::Vector2d(0, 1), Eigen::Vector2d(4, 3)},
                                                          {Eigen::Vector2d(1, 0), Eigen::Vector2d(3, 4)}};
  TriangulateConstrained(square, cross, t);
  EXPECT_TRUE(std::any_of(t.points.begin(), t.points.end(),
                          [](const auto& p) { return (p - Eigen::Vector2d(2, 2)).norm() < 1e-12; }));
  double area = 0;
  for (const auto& f : t.triangles) {
    const auto p = [&](std::size_t i) { return t.points[static_cast<std::size_t>(f[i])]; };
    const Eigen::Vector2d u = p(1) - p(0), v = p(2) - p(0);
    area += (u.x() * v.y() - u.y() * v.x()) / 2;
  }
  EXPECT_NEAR(area, 16, 1e-12);
}

TEST(SparseProxy, MergesCoplanarNeighbours) {
  const SparseProxy box(test::PlaneAndBox(), {});
  EXPECT_TRUE(box.coarse());
  EXPECT_EQ(box.facets().size(), 7U);
  for (const Facet& f : box.facets()) EXPECT_EQ(f.border.size(), 4U);
  EXPECT_TRUE(box.facets()[0].Contains({0, 0, 3}));
  EXPECT_FALSE(box.facets()[0].Contains({9, 0, 3}));
  EXPECT_FALSE(SparseProxy(test::Sheet(20), {}).coarse());
  Mesh fine_plane = test::Sheet(40);
  for (auto& v : fine_plane.vertices) v.z() = 0.3 * v.x() - 0.1 * v.y();
  const SparseProxy flat(fine_plane, {});
  EXPECT_TRUE(flat.coarse());
  EXPECT_EQ(flat.facets().size(), 1U);
}

TEST(SparsePlan, TrianglesOfAConvexSceneCoverEachPixelOnce) {
  test::Capture c = test::MakeCapture(3, 24);
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(1.3, 0.4, -4.2), Eigen::Vector3d(-2, 1.5, -2),
                                     Eigen::Vector3d(0, 0, -1.1), Eigen::Vector3d(6, 3, 2.5)}) {
    const RenderView view =
        MakeRenderView(Camera::Pinhole(320, 240, 250, 250, 160, 120), LookAt(eye, {0, 0, 0.5}, {0, -1, 0}));
    const std::vector<bool> hit = Hit(c, view);
    for (const int grid : {2, 7, 25}) {
      const std::vector<int> covered =
          Covered(PlanOf(c, test::SparseRequest(view, 3, grid, Sampling::kInterpolated)), view.size_px);
      int wrong = 0;
      for (std::size_t i = 0; i < hit.size(); ++i) wrong += covered[i] != (hit[i] ? 1 : 0) ? 1 : 0;
      // Pixels whose centres lie within the lattice's 1/512 of a silhouette.
      EXPECT_LE(wrong, 4) << eye.transpose() << " grid " << grid;
    }
  }
}

TEST(SparsePlan, WeightsSumToOneAndPhotosAreAtMostThreeTimesK) {
  const test::Capture c = test::MakeCapture(9, 32);
  for (const int k : {1, 2, 4, 9}) {
    const SparsePlan plan =
        PlanOf(c, test::SparseRequest(test::ViewOf(c, {0.7, 0.3, -4}), k, 12, Sampling::kInterpolated));
    EXPECT_EQ(test::Wrong(plan), "");
    EXPECT_GT(plan.triangles.size(), 2U * 11 * 11 - 1);
    for (const SparseTriangle& t : plan.triangles) {
      EXPECT_LE(t.count, 3 * k);
      EXPECT_TRUE(std::is_sorted(plan.camera.begin() + t.first, plan.camera.begin() + t.first + t.count));
    }
  }
}

TEST(SparsePlan, EpipolesInFrontAndBehindAreSamplesOfTheirPhotoAlone) {
  const test::Capture c = test::MakeCapture(9, 64);
  // Between the arc of cameras and the box: they are behind; and behind the arc: they are in front of the proxy.
  for (const Eigen::Vector3d& eye : {Eigen::Vector3d(0.3, 0.05, -3.6), Eigen::Vector3d(0.2, 0, -7)}) {
    RenderRequest r = test::SparseRequest(test::ViewOf(c, eye), 3, 6, Sampling::kInterpolated);
    const SparsePlan plan = PlanOf(c, r);
    ASSERT_GT(plan.epipoles_px.size(), 2U);
    const ViewSetup setup = MakeViewSetup(MakeSources(c.scene), r.view, r.settings);
    int checked = 0;
    for (std::size_t j = 0; j < 9; ++j) {
      const RelativeSources& s = setup.sources;
      const Eigen::Vector3d e = setup.desired.P.leftCols<3>() * Eigen::Vector3d(s.dx[j], s.dy[j], s.dz[j]);
      for (const SparseTriangle& t : plan.triangles)
        for (std::size_t i = 0; i < 3; ++i) {
          const auto v = static_cast<std::size_t>(t.vertex[i]);
          if ((plan.x_px[v].cast<double>() - e.hnormalized()).norm() > 0.01) continue;
          // Where the photo sees the point, well inside; else it is no epipole that counts.
          const Eigen::Vector3f p = plan.offset[v] - Eigen::Vector3f(s.dx[j], s.dy[j], s.dz[j]);
          const auto row = [&](std::size_t k) {
            return s.m[3 * k][j] * p.x() + s.m[3 * k + 1][j] * p.y() + s.m[3 * k + 2][j] * p.z();
          };
          const float u = row(0) / row(2), w = row(1) / row(2);
          if (row(2) <= 0 || u < 8 || w < 8 || u > 56 || w > 40) continue;
          float weight = 0;
          for (auto k = static_cast<std::size_t>(t.first); k < static_cast<std::size_t>(t.first + t.count); ++k)
            if (plan.camera[k] == static_cast<std::int32_t>(j)) weight = plan.weight[k][i];
          // The lattice moves an epipole by up to 1/512 pixel.
          EXPECT_GT(weight, 0.995F) << j;
          ++checked;
        }
    }
    EXPECT_GT(checked, 5);
    r.settings.epipoles = false;
    EXPECT_TRUE(PlanOf(c, r).epipoles_px.empty());
  }
}

TEST(SparsePlan, AFineMeshIsSplitToTheGridWithoutGaps) {
  test::Capture c = test::MakeCapture(3, 24);
  c.proxy = test::Sheet(16);  // 512 facets of some 15 pixels
  const RenderView view =
      MakeRenderView(Camera::Pinhole(320, 240, 250, 250, 160, 120), LookAt({0.3, 0.2, -1.5}, {0, 0, 0.5}, {0, -1, 0}));
  const SparsePlan coarse = PlanOf(c, test::SparseRequest(view, 3, 4, Sampling::kInterpolated));
  const SparsePlan fine = PlanOf(c, test::SparseRequest(view, 3, 40, Sampling::kInterpolated));
  EXPECT_GT(fine.triangles.size(), 3 * coarse.triangles.size());
  for (const SparsePlan* plan : {&coarse, &fine}) {
    EXPECT_EQ(test::Wrong(*plan), "");
    const std::vector<int> covered = Covered(*plan, view.size_px);
    const std::vector<bool> hit = Hit(c, view);
    int gaps = 0;
    for (std::size_t i = 0; i < hit.size(); ++i) gaps += hit[i] && covered[i] == 0 ? 1 : 0;
    EXPECT_LE(gaps, 4);
  }
  // Edges are about as long as a cell's diagonal at most.
  const Eigen::Vector2f cell(320.0F / 39, 240.0F / 39);
  for (const SparseTriangle& t : fine.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector2f d =
          fine.x_px[static_cast<std::size_t>(t.vertex[i])] - fine.x_px[static_cast<std::size_t>(t.vertex[(i + 1) % 3])];
      // Of those that leave the view their part in it counts.
      const auto outside = [&](std::size_t k) {
        const Eigen::Vector2f& x = fine.x_px[static_cast<std::size_t>(t.vertex[k])];
        return x.x() < 0 || x.y() < 0 || x.x() > 320 || x.y() > 240;
      };
      if (outside(i) || outside((i + 1) % 3)) continue;
      EXPECT_LT((d.array() / cell.array()).matrix().norm(), 1.5F + 1e-3F);
    }
}

TEST(SparsePlan, ItDoesNotDependOnHowTheLoopIsSplit) {
  const test::Capture c = test::MakeCapture(9, 32);
  const RenderRequest r = test::SparseRequest(test::ViewOf(c, {0.7, 0.3, -4}), 4, 17, Sampling::kInterpolated);
  const SparsePlan a = PlanOf(c, r);
  SparsePlan b;
  PlanSparse(MakeViewSetup(MakeSources(c.scene), r.view, r.settings),
             SparseProxy(c.proxy, c.scene.normalized_from_world), nullptr, ParallelFor, b);
  EXPECT_EQ(a.camera, b.camera);
  EXPECT_EQ(a.weight, b.weight);
  EXPECT_EQ(a.x_px, b.x_px);
}

TEST(CandidatePlan, ListsThePhotosOfEachCellsSamplesForFewFacetsAndMany) {
  test::Capture c = test::MakeCapture(13, 32);
  for (const bool fine : {false, true}) {
    if (fine) c.proxy = test::Sheet(24);
    const RenderRequest r = test::SparseRequest(test::ViewOf(c, {0.7, 0.3, -3}), 3, 9, Sampling::kCandidates);
    const ViewSetup setup = MakeViewSetup(MakeSources(c.scene), r.view, r.settings);
    CandidatePlan plan;
    PlanCandidates(setup, SparseProxy(c.proxy, c.scene.normalized_from_world),
                   ProxyTracer(c.proxy, c.scene.normalized_from_world), nullptr, InTurn, plan);
    ASSERT_EQ(plan.first.size(), 65U);
    for (std::size_t cell = 0; cell < 64; ++cell) {
      EXPECT_GE(plan.first[cell + 1] - plan.first[cell], 6);
      EXPECT_TRUE(std::is_sorted(plan.camera.begin() + plan.first[cell], plan.camera.begin() + plan.first[cell + 1]));
    }
  }
}

}  // namespace
}  // namespace lumi
