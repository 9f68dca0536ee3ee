// Visual hulls: volumes of bodies whose volume is known, hulls of captures, detail against time. As docs/proxy.md
// quotes.
//
//   hull_bench volumes
//   hull_bench captures|detail [DIR]   on dinosaur and dino-rings below DIR
#include <fmt/format.h>

#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <numbers>
#include <vector>

#include "proxy/hull/visual_hull.h"
#include "scene/program/error.h"
#include "scene/program/parallel.h"
#include "tests/proxy/hull_bodies.h"
#include "tests/proxy/hull_captures.h"

namespace lumi {
namespace {

using std::numbers::pi;

// The same 64 views in each row's first 4, 8, 16 ..., which stand all around.
void PrintVolumes() {
  struct Shape {
    const char* name;
    test::Body body;
    double volume;
  };
  const Shape shapes[] = {{"ball", test::Ellipsoid({1, 1, 1}), 4.0 / 3 * pi},
                          {"ellipsoid 1 x 0.7 x 0.5", test::Ellipsoid({1, 0.7, 0.5}), 4.0 / 3 * pi * 0.35},
                          {"cube", test::Block({0.6, 0.6, 0.6}), 8 * 0.216}};
  fmt::print("| views | 4 | 8 | 16 | 32 | 64 |\n|---|---|---|---|---|---|\n");
  for (const Shape& shape : shapes) {
    const std::vector<SilhouetteView> around = test::Around(shape.body, 64);
    std::vector<SilhouetteView> all;
    for (std::size_t n = 0; n < around.size(); ++n)
      all.push_back(around[n * 27 % around.size()]);  // 27 has no divisor in common with 64
    fmt::print("| {} |", shape.name);
    for (const int views : {4, 8, 16, 32, 64}) {
      HullSummary s;
      BuildVisualHull({all.begin(), all.begin() + views}, {}, SilentProgress(), &s);
      fmt::print(" {:.3f} |", s.volume / shape.volume);
    }
    fmt::print("\n");
  }
}

struct MadeHull {
  Mesh mesh;
  HullSummary summary;
  double seconds;
};
MadeHull Make(const std::vector<SilhouetteView>& views, const HullOptions& options) {
  MadeHull made;
  const auto start = std::chrono::steady_clock::now();
  made.mesh = BuildVisualHull(views, options, SilentProgress(), &made.summary);
  made.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return made;
}

void PrintCapture(const char* name, const std::vector<SilhouetteView>& views) {
  const MadeHull m = Make(views, {});
  const HullSummary& s = m.summary;
  double most = 0;
  for (const auto& mended : s.mended) most = std::max(most, mended.share);
  fmt::print("| {} | {} | {} | {} | {:.2f} | {} | {:.2f} % | {:.1f} | {:.3f} | {:.1f} |\n", name, views.size(),
             s.used.size(), s.mended.empty() ? "-" : fmt::format("{}, {:.1f} %", s.mended.size(), 100 * most),
             s.dilation_px, m.mesh.faces.size(), 100 * s.fit.coverage_min, s.fit.deepest_uncovered_px, s.fit.iou_median,
             m.seconds);
}

void PrintCaptures(const std::filesystem::path& data) {
  fmt::print(
      "| | views | used | mended, by at most | dilation px | faces | coverage least | deepest px | IoU median | "
      "seconds "
      "|\n|---|---|---|---|---|---|---|---|---|---|\n");
  if (std::filesystem::exists(data / "dinosaur")) PrintCapture("dinosaur, 720x576", test::DinosaurSilhouettes(data));
  if (!std::filesystem::exists(data / "dino-rings")) return;
  PrintCapture("dino-rings, 640x480, every second photo with a good silhouette",
               test::DinoRingsSilhouettes(data, 2, true));
  PrintCapture("dino-rings, every fourth photo, shadows and all", test::DinoRingsSilhouettes(data, 4, false));
}

void PrintDetail(const std::filesystem::path& data) {
  const std::vector<SilhouetteView> views = test::DinosaurSilhouettes(data);
  fmt::print(
      "| cell px | faces | dilation px | coverage least | deepest px | IoU median | seconds "
      "|\n|---|---|---|---|---|---|---|\n");
  for (const double cell : {8.0, 4.0, 2.0, 1.0}) {
    HullOptions options;
    options.cell_px = cell;
    const MadeHull m = Make(views, options);
    fmt::print("| {:g} | {} | {:.2f} | {:.2f} % | {:.1f} | {:.3f} | {:.1f} |\n", cell, m.mesh.faces.size(),
               m.summary.dilation_px, 100 * m.summary.fit.coverage_min, m.summary.fit.deepest_uncovered_px,
               m.summary.fit.iou_median, m.seconds);
  }
}

}  // namespace
}  // namespace lumi

int main(int argc, char** argv) {
  lumi::SetThreadCount(2);
  const char* what = argc > 1 ? argv[1] : "";
  const std::filesystem::path data = argc > 2 ? argv[2] : "";
  try {
    if (std::strcmp(what, "volumes") == 0)
      lumi::PrintVolumes();
    else if (std::strcmp(what, "captures") == 0)
      lumi::PrintCaptures(data);
    else if (std::strcmp(what, "detail") == 0)
      lumi::PrintDetail(data);
    else
      return fmt::print(stderr, "hull_bench volumes | captures DIR | detail DIR\n"), 2;
  } catch (const lumi::Error& e) {
    fmt::print(stderr, "hull_bench: {}\n", e.what());
    return 1;
  }
  return 0;
}
