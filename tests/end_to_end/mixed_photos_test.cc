// Captures as people make them: portrait among landscape, photos taken twice, many photos from one place, blurred ones.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "scene/files/image_io.h"
#include "tests/support/found_cameras.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

constexpr int kPhotos = 16, kWidthPx = 480;
// Some three times what was seen.
constexpr PoseErrors kAsOthers = {.centre_max_percent = 0.15, .rotation_max_deg = 0.15};
// What one photo's features are off by counts as often as the photo does: it bends the lens that all share.
constexpr PoseErrors kOnePlaceOften = {.centre_max_percent = 0.3, .rotation_max_deg = 0.6};

std::vector<fs::path> PhotosOf(const fs::path& folder) {
  std::vector<fs::path> photos;
  for (const auto& entry : fs::directory_iterator(folder)) photos.push_back(entry.path());
  std::ranges::sort(photos);
  return photos;
}

// The same moment again: other noise, other compression.
void TakeAgain(const fs::path& photo, const fs::path& again, unsigned seed) {
  Image8 image = ReadImage8(photo);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 2);
  for (std::uint8_t& value : image.data)
    value = static_cast<std::uint8_t>(std::clamp(std::lround(value + noise(random)), 0L, 255L));
  WriteImage(again, image, 88);
}

// "photo.jpg" of "photo again 3.jpg".
std::string Original(const std::string& name) {
  const auto again = name.find(" again");
  return again == std::string::npos ? name : name.substr(0, again) + name.substr(name.rfind('.'));
}

fs::path AgainName(const fs::path& photo, int number) {
  return photo.stem().string() + fmt::format(" again {}", number) + photo.extension().string();
}

void ExpectAllPlaced(const SimulatedCapture& capture, std::size_t photos, std::size_t cameras,
                     const PoseErrors& most = kAsOthers) {
  const ProgramResult run =
      ChildProgram({"lumi-reconstruct", capture.photos().string(), "-o", (capture / "scene").string()}).Wait(900);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const FoundCameras found = CompareWithCapture(capture / "scene", capture.path(), Original);
  std::cout << fmt::format("centres {:.3f} %, rotations {:.3f} degree at worst\n", found.errors.centre_max_percent,
                           found.errors.rotation_max_deg);
  EXPECT_EQ(found.photos, photos);
  EXPECT_EQ(found.cameras, cameras);
  EXPECT_LT(found.errors.centre_max_percent, most.centre_max_percent);
  EXPECT_LT(found.errors.rotation_max_deg, most.rotation_max_deg);
}

TEST(MixedPhotos, PortraitAmongLandscape) {
  const SimulatedCapture capture("desk", kPhotos, kWidthPx, {"--portrait-every", "3"});
  ExpectAllPlaced(capture, kPhotos, 1);  // one lens: pixels are as the sensor has them
}

TEST(MixedPhotos, SomeTakenTwiceAndSomeCopied) {
  const SimulatedCapture capture("desk", kPhotos, kWidthPx);
  const auto photos = PhotosOf(capture.photos());
  for (int i = 0; i < 6; ++i) {
    const fs::path& photo = photos[static_cast<std::size_t>(2 * i)];
    const fs::path again = capture.photos() / AgainName(photo, 0);
    if (i % 2 == 0)
      fs::copy_file(photo, again);
    else
      TakeAgain(photo, again, static_cast<unsigned>(i));
  }
  ExpectAllPlaced(capture, kPhotos + 6, 1);
}

TEST(MixedPhotos, ManyFromOnePlaceAmongOthers) {
  constexpr int kAgain = 24;
  const SimulatedCapture capture("desk", kPhotos, kWidthPx);
  const auto photos = PhotosOf(capture.photos());
  for (int i = 0; i < kAgain; ++i)
    TakeAgain(photos[7], capture.photos() / AgainName(photos[7], i), static_cast<unsigned>(i));
  ExpectAllPlaced(capture, kPhotos + kAgain, 1, kOnePlaceOften);
}

// A third of the photos are blurred over 6 px: the sharp ones stand as they would without them, and a blurred one that
// has no camera is named.
TEST(MixedPhotos, BlurredOnesDoNoHarm) {
  const SimulatedCapture capture("desk", kPhotos, kWidthPx);
  const auto photos = PhotosOf(capture.photos());
  std::set<std::string> blurred;
  for (std::size_t i = 1; i < photos.size(); i += 3) {
    const Image8 sharp = ReadImage8(photos[i]);
    constexpr int kBlurPx = 6;
    const Image8 small = Resize(sharp, sharp.width / kBlurPx, sharp.height / kBlurPx);
    WriteImage(photos[i], Resize(small, sharp.width, sharp.height));
    blurred.insert(photos[i].filename().string());
  }
  const ProgramResult run =
      ChildProgram({"lumi-reconstruct", capture.photos().string(), "-o", (capture / "scene").string(), "--json"})
          .Wait(900);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const FoundCameras sharp = CompareWithCapture(capture / "scene", capture.path(), [&](const std::string& name) {
    return blurred.contains(name) ? std::string() : name;
  });
  EXPECT_EQ(sharp.photos, photos.size() - blurred.size());
  EXPECT_LT(sharp.errors.centre_max_percent, kAsOthers.centre_max_percent);
  EXPECT_LT(sharp.errors.rotation_max_deg, kAsOthers.rotation_max_deg);
  std::set<std::string> accounted;
  const auto summary = nlohmann::json::parse(run.out);
  for (const auto& missing : summary["missing"]) accounted.insert(missing["name"]);
  for (const View& view : ReadColmapModel(capture / "scene" / "sparse").views) accounted.insert(view.name);
  EXPECT_EQ(accounted.size(), photos.size());
}

}  // namespace
}  // namespace lumi
