// Hulls of photographs of real things.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "proxy/hull/soundness.h"
#include "proxy/hull/visual_hull.h"
#include "scene/files/mesh_io.h"
#include "scene/program/parallel.h"
#include "tests/proxy/hull_captures.h"

namespace lumi::test {
namespace {

namespace fs = std::filesystem;
const fs::path kCaptures = fs::path(LUMI_SOURCE_DIR) / ".." / "shared" / "data";

struct Made {
  Mesh mesh;
  HullSummary summary;
  double processor_s;  // whatever else the machine does
};
Made Hull(const char* what, const std::vector<SilhouetteView>& views, HullOptions options = {}) {
  if (const char* cell = std::getenv("HULL_CELL")) options.cell_px = std::atof(cell);
  Made made;
  const std::clock_t start = std::clock();
  made.mesh = BuildVisualHull(views, options, SilentProgress(), &made.summary);
  made.processor_s = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const HullSummary& s = made.summary;
  std::printf(
      "%s: %zu views, %zu used, dilation %.2f px, cell %.2f px, %zu faces, coverage min %.4f, deepest %.2f px, IoU "
      "median %.4f min %.4f, "
      "%.1f s of processors (agreement %.1f, mending %.1f, contour %.1f, measure %.1f)\n",
      what, views.size(), s.used.size(), s.dilation_px, s.cell_px, made.mesh.faces.size(), s.fit.coverage_min,
      s.fit.deepest_uncovered_px, s.fit.iou_median, s.fit.iou_min, made.processor_s, s.agreement_s, s.mend_s,
      s.contour_s, s.measure_s);
  if (!s.mended.empty()) {
    double most = 0;
    for (const auto& m : s.mended) most = std::max(most, m.share);
    std::printf("  %zu mended, by %.1f %% at most\n", s.mended.size(), 100 * most);
  }
  for (const auto& l : s.left_out) std::printf("  left out %s: %s\n", l.name.c_str(), l.reason.c_str());
  if (const char* folder = std::getenv("HULL_OUT"))
    WriteMesh(fs::path(folder) / (std::string(what) + ".ply"), made.mesh);
  return made;
}

void ExpectHull(const Made& made, double iou_median) {
  EXPECT_TRUE(CheckSoundness(made.mesh).IsSolid()) << CheckSoundness(made.mesh).Describe();
  EXPECT_GE(made.summary.fit.coverage_min, 0.995);
  EXPECT_LE(made.summary.fit.deepest_uncovered_px, 2);
  EXPECT_GE(made.summary.fit.iou_median, iou_median);
}

TEST(HullCaptures, DinosaurOnATurntable) {
  if (!fs::exists(kCaptures / "dinosaur")) GTEST_SKIP() << "no ../shared/data/dinosaur here";
  SetThreadCount(2);
  const std::vector<SilhouetteView> views = DinosaurSilhouettes(kCaptures);
  ASSERT_EQ(views.size(), 36u);
  const Made made = Hull("dinosaur", views);
  ExpectHull(made, 0.90);
  EXPECT_LT(made.processor_s, 2 * 60);
}

TEST(HullCaptures, DinoRings) {
  if (!fs::exists(kCaptures / "dino-rings")) GTEST_SKIP() << "no ../shared/data/dino-rings here";
  SetThreadCount(2);
  const Made made = Hull("dino-rings-good-2", DinoRingsSilhouettes(kCaptures, 2, true));
  ExpectHull(made, 0.95);
  EXPECT_GE(made.summary.used.size(), 46u);  // of 52
}

// A third of these silhouettes lack what lies in shadow: they are mended, or left out where much is missing.
TEST(HullCaptures, DinoRingsWithShadows) {
  if (!fs::exists(kCaptures / "dino-rings")) GTEST_SKIP() << "no ../shared/data/dino-rings here";
  SetThreadCount(2);
  const Made made = Hull("dino-rings-all-4", DinoRingsSilhouettes(kCaptures, 4, false));
  ExpectHull(made, 0.95);
  EXPECT_GE(made.summary.used.size(), 28u);  // of 37
  EXPECT_LT(made.processor_s, 2 * 60);
}

}  // namespace
}  // namespace lumi::test
