// A view's own proxy: milliseconds to triangulate structure points in it, beside two libraries' Delaunay triangulations
// of the same image points, which neither project, merge, clean nor close the image.
//
//   view_triangulation_bench [--scene SCENE ...]
#include <CGAL/Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <random>

#include "scene/files/scene_folder.h"
#include "scene/geometry/median.h"
#include "scene/program/error.h"
#include "scene/view_triangulation/lattice_delaunay.h"
#include "scene/view_triangulation/view_triangulation.h"

namespace {

using namespace lumi;
using CgalDelaunay = CGAL::Delaunay_triangulation_2<CGAL::Exact_predicates_inexact_constructions_kernel>;

double MedianMs(const std::function<void()>& run) {
  std::vector<double> ms;
  for (int i = 0; i < 21; ++i) {
    const auto start = std::chrono::steady_clock::now();
    run();
    ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
  }
  return Median(ms);
}

void Row(const char* name, const Matrix34d& P, const Eigen::Vector2i& size_px, const std::vector<Eigen::Vector4d>& X,
         const std::optional<Plane>& infinity) {
  const ViewTriangulation t = TriangulateView(P, size_px, X, infinity);
  std::vector<CgalDelaunay::Point> cgal;
  std::vector<cv::Point2f> opencv;
  std::vector<LatticePoint> lattice{{0, 0}, {1 << 20, 0}, {1 << 20, 1 << 20}, {0, 1 << 20}};
  const cv::Rect2f bounds(-1000, -1000, static_cast<float>(size_px.x()) + 2000, static_cast<float>(size_px.y()) + 2000);
  for (std::size_t i = 0; i < t.vertices.size(); ++i) {
    if (t.point[i] < 0) continue;
    cgal.emplace_back(t.x_px[i].x(), t.x_px[i].y());
    opencv.emplace_back(static_cast<float>(t.x_px[i].x()), static_cast<float>(t.x_px[i].y()));
    lattice.push_back({static_cast<std::int32_t>((t.x_px[i].x() + 1000) * 256),
                       static_cast<std::int32_t>((t.x_px[i].y() + 1000) * 256)});
  }
  const double whole = MedianMs([&] { TriangulateView(P, size_px, X, infinity); });
  const double delaunay = MedianMs([&] { TriangulateLattice(lattice); });
  const double by_cgal = MedianMs([&] {
    CgalDelaunay d;
    d.insert(cgal.begin(), cgal.end());
  });
  const double by_opencv = MedianMs([&] {
    cv::Subdiv2D d(cv::Rect(static_cast<int>(bounds.x), static_cast<int>(bounds.y), static_cast<int>(bounds.width),
                            static_cast<int>(bounds.height)));
    d.insert(opencv);
  });
  std::printf("| %s | %zu | %zu | %zu | %.2f | %.2f | %.2f | %.2f | %.2f | %.2f |\n", name, X.size(), t.used,
              t.triangles.size(), whole, delaunay, by_cgal, by_opencv, whole / by_cgal, whole / by_opencv);
}

}  // namespace

int main(int argc, char** argv) {
  std::printf(
      "| points | given | used | triangles | whole ms | Delaunay ms | CGAL ms | OpenCV ms | whole / CGAL | whole / "
      "OpenCV |\n|---|---|---|---|---|---|---|---|---|---|\n");
  Matrix34d P;
  P << 800, 0, 640, 0, 0, 800, 360, 0, 0, 0, 1, 0;
  for (const int count : {500, 2000, 8000, 20000}) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> u(0, 1280), v(0, 720);
    std::vector<Eigen::Vector4d> X;
    for (int i = 0; i < count; ++i) {
      const double x = u(random), y = v(random), depth = 2.5 + 0.5 * std::sin(x / 150) * std::cos(y / 120);
      X.emplace_back((x - 640) / 800 * depth, (y - 360) / 800 * depth, depth, 1);
    }
    Row("waves, 1280 x 720", P, {1280, 720}, X, Plane(0, 0, 0, 1));
  }
  try {
    for (int i = 2; i < argc; ++i) {
      OpenOptions options;
      options.check_photos = false;
      const Scene scene = OpenScene(argv[i], options, SilentProgress());
      const RenderView view = MakeRenderView(scene, scene.views[scene.views.size() / 2]);
      Row(std::filesystem::path(argv[i]).filename().c_str(), view.P, view.size_px, StructurePoints(scene),
          PlaneAtInfinity(scene));
    }
  } catch (const Error& e) {
    return std::fprintf(stderr, "view_triangulation_bench: %s\n", e.what()), static_cast<int>(e.code());
  }
}
