#include "pipeline/report/fronts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "tests/support/occurrences.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

TEST(Fronts, OfASceneThatMeasuredNothingThereIsNone) {
  const TemporaryFolder scene;
  EXPECT_EQ(FrontsSvg(scene.path(), {}), "");
  EXPECT_EQ(FrontsSvg(scene / "nowhere", {}), "");
}

TEST(Fronts, EachStageIsAPanelWithWhatTheSceneWasMadeWith) {
  const TemporaryFolder scene;
  WriteTextAtomically(scene / "fronts" / "dense-cpu-640x480-1.json",
                      R"({"proxy":"dense","points":[{"name":"interpolated 8x8, k 2","ms":5,"psnr_holdout_db":20.1},
                                    {"name":"candidates 25x25, k 4","ms":16,"psnr_holdout_db":30.4},
                                    {"name":"worse","ms":20,"psnr_holdout_db":25}]})");
  WriteTextAtomically(scene / "tradeoff" / "colmap.json",
                      R"({"points":[{"name":"as given: 8192 features","seconds":9,"centre_rms_percent":0.02},
                                    {"name":"2048 features","seconds":4,"centre_rms_percent":0.05},
                                    {"name":"failed","seconds":4,"failed":"too few matches"}]})");
  const std::string svg = FrontsSvg(scene.path(), {"full", "dense", "candidates 25x25, k 4"});
  for (const char* text : {"Cameras", "Rendering", "dense-cpu-640x480-1", "candidates 25x25, k 4", "as given",
                           "centres off, % of the extent", "held-out PSNR, dB"})
    EXPECT_THAT(svg, HasSubstr(text));
  EXPECT_EQ(Occurrences(svg, ">this scene<"), 1U);
  EXPECT_THAT(svg, Not(HasSubstr(" 460)")));  // one row
  // Without a film, or over another proxy, no setting of the renderer is this scene's.
  EXPECT_EQ(Occurrences(FrontsSvg(scene.path(), {}), ">this scene<"), 0U);
  EXPECT_EQ(Occurrences(FrontsSvg(scene.path(), {"full", "mesh", "candidates 25x25, k 4"}), ">this scene<"), 0U);
}

TEST(Fronts, ASceneOfATradeoffOfTheWholeIsOneOfItsQualities) {
  const TemporaryFolder out;
  WriteTextAtomically(
      out / "tradeoff" / "pipeline.json",
      R"({"qualities":[{"name":"draft","minutes":1,"psnr_db":20},{"name":"full","minutes":4,"psnr_db":22}]})");
  fs::create_directories(out / "full");
  EXPECT_EQ(Occurrences(FrontsSvg(out / "full", {"full", "", ""}), ">this scene<"), 1U);
  EXPECT_EQ(Occurrences(FrontsSvg(out / "full", {"other", "", ""}), ">this scene<"), 0U);
}

TEST(Fronts, AWindowOfAFilmHasTheFilmsDials) {
  const TemporaryFolder film;
  WriteTextAtomically(film / "tradeoff.json",
                      R"({"points":[{"dial":"as chosen","value":"","ms_per_frame":20,"jitter_px":0.5},
                                    {"dial":"k","value":"8","ms_per_frame":40,"jitter_px":0.4},
                                    {"dial":"k","value":"1","ms_per_frame":10,"jitter_px":0.9}]})");
  const fs::path scene = film / "window-000" / "scene";
  fs::create_directories(scene);
  const std::string svg = FrontsSvg(scene, {});
  for (const char* text : {"Stabilising", "jitter above 1 Hz, px", "as given", "k 8"})
    EXPECT_THAT(svg, HasSubstr(text));
}

TEST(Fronts, AnAccuracyThatNoRowHasGivesWayToTheNext) {
  const TemporaryFolder scene;
  WriteTextAtomically(scene / "tradeoff" / "simplify-hull.json",
                      R"({"points":[{"method":"collapse","faces":500,"psnr_mean_db":null,"iou_median":0.97},
                                    {"method":"collapse","faces":50,"psnr_mean_db":null,"iou_median":0.9}]})");
  EXPECT_THAT(FrontsSvg(scene.path(), {}), HasSubstr("silhouettes (IoU)"));
}

TEST(Fronts, FilesThatAreNoTablesAreLeftOut) {
  const TemporaryFolder scene;
  for (const char* text : {"", "{", "[]", "{\"points\": 3}", "{\"points\": [3, null, {}]}",
                           "{\"points\": [{\"seconds\": \"x\", \"psnr_holdout_db\": 1}]}",
                           "{\"points\": [{\"seconds\": 0, \"psnr_holdout_db\": 1}]}"}) {
    WriteTextAtomically(scene / "tradeoff" / "dense.json", text);
    EXPECT_EQ(FrontsSvg(scene.path(), {}), "") << text;
  }
}

TEST(Fronts, MoreThanTwoAreInRows) {
  const TemporaryFolder scene;
  const char* one =
      R"({"points":[{"name":"as given","seconds":1,"psnr_holdout_db":20,"iou_median":1,"centre_rms_percent":1}]})";
  for (const char* name : {"colmap", "dense", "hull"})
    WriteTextAtomically(scene / "tradeoff" / (std::string(name) + ".json"), one);
  const std::string svg = FrontsSvg(scene.path(), {});
  EXPECT_EQ(Occurrences(svg, "translate(0 460)"), 1U);
  EXPECT_THAT(svg, HasSubstr("viewBox='0 0 1280 920'"));
}

}  // namespace
}  // namespace lumi
