// Pages of whole captures, in a real browser: they show what lumi-render shows over the same data, begin soon, and stay
// within the memory that they were given.
#include <gtest/gtest.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tests/support/simulated_capture.h"
#include "tests/support/static_server.h"
#include "tests/support/web_page.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

constexpr double kEdge = 0.01;  // of the pixels: at silhouettes a rasteriser and a tracer may disagree
const fs::path kData = fs::path(LUMI_SOURCE_DIR) / ".." / "shared" / "data";
constexpr double kMostSeconds = 1200;   // of a program, on a busy machine
constexpr double kStreamedBytes = 2e6;  // to the first picture

Chromium& Browser() {
  static Chromium browser(800, 600);
  return browser;
}

nlohmann::json Export(const fs::path& scene, const fs::path& output, std::vector<std::string> more) {
  std::vector<std::string> argv{"lumi-export", "web", scene.string(), "-o", output.string(), "--json", "--quiet"};
  argv.insert(argv.end(), more.begin(), more.end());
  const ProgramResult made = ChildProgram(argv).Wait(kMostSeconds);
  if (made.exit_code != 0) throw std::runtime_error("lumi-export failed: " + made.err);
  return nlohmann::json::parse(made.out);
}

// Six photos' own cameras and five views between.
void ExpectTheRenderersPictures(const fs::path& scene, const fs::path& folder) {
  const fs::path page = folder / "page.html", data = folder / "page-data";
  const nlohmann::json made = Export(scene, page, {"--as-scene", data.string()});
  OpenPage(Browser(), "file://" + page.string());
  const PageAgreement agreement = AgreementOf(Browser(), data, scene, 6, 5);
  EXPECT_GE(agreement.worst.psnr_db, kSamePictureDb) << agreement.worst_view;
  EXPECT_LE(agreement.worst.differ, kEdge);
  std::printf("%d photos in %.1f MB: %.1f dB at the worst (%s), %.1f dB against the whole scene\n",
              made["photos"].get<int>(), made["mb"].get<double>(), agreement.worst.psnr_db,
              agreement.worst_view.c_str(), agreement.of_scene_db);
}

TEST(WebScenes, ADeskOf24Photos) {
  SKIP_WITHOUT_BROWSER();
  const SimulatedCapture desk("desk", 24, 640);
  ExpectTheRenderersPictures(desk.path(), desk / "web");
}

TEST(WebScenes, ADeskOf262Photos) {
  SKIP_WITHOUT_BROWSER();
  const SimulatedCapture desk("desk", 262, 640);
  ExpectTheRenderersPictures(desk.path(), desk / "web");
}

TEST(WebScenes, ARealCapture) {
  SKIP_WITHOUT_BROWSER();
  if (!fs::exists(kData / "fox")) GTEST_SKIP() << "no ../shared/data/fox here";
  const TemporaryFolder folder;
  const std::string photos = (kData / "fox" / "images").string(), scene = (folder / "fox").string();
  ASSERT_EQ(ChildProgram({"lumi-reconstruct", photos, "-o", scene, "--quiet"}).Wait(kMostSeconds).exit_code, 0);
  ASSERT_EQ(ChildProgram({"lumi-proxy", "auto", scene, "--depth-width", "320", "--quiet"}).Wait(kMostSeconds).exit_code,
            0);
  ExpectTheRenderersPictures(scene, folder / "web");
}

TEST(WebScenes, AFolderOfAHundredPhotosBeginsAfterTwoMegabytesAndStaysWithinItsMemory) {
  SKIP_WITHOUT_BROWSER();
  const SimulatedCapture desk("desk", 100, 640);
  const fs::path folder = desk / "web-folder";
  constexpr double kMemoryMb = 96;  // for photos that take 164 MB in full
  Export(desk.path(), folder, {"--memory-mb", "96"});
  const StaticServer server(folder);
  Chromium& browser = Browser();
  OpenPage(browser, server.Url("index.html"));
  EXPECT_LE(browser.Evaluate("lumigraph.firstPicture.bytes").get<double>() +
                static_cast<double>(fs::file_size(folder / "index.html")),
            kStreamedBytes);
  EXPECT_EQ(browser.Evaluate("lumigraph.photos.loadedCount").get<int>(), 100) << "each at least small";
  // Along the path, sharp photos replace each other.
  for (int i = 0; i < 10; ++i) {
    browser.Evaluate("(lumigraph.camera.setPose(lumigraph.camera.constructor.poseOf(lumigraph.manifest.photos[" +
                     std::to_string(10 * i) + "])), lumigraph.state.dirty = true)");
    ASSERT_TRUE(browser.WaitFor("!lumigraph.state.dirty && lumigraph.photos.finished", 120));
    EXPECT_LE(browser.Evaluate("lumigraph.graphicsBytes").get<double>(), kMemoryMb * 1e6);
    EXPECT_EQ(browser.Evaluate("lumigraph.photos.levelOf(" + std::to_string(10 * i) + ")").get<int>(), 0)
        << "the photo at the view is sharp";
  }
  EXPECT_TRUE(browser.errors().empty());
}

}  // namespace
}  // namespace lumi
