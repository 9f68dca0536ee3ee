// What is allowed among photos: other sizes and cameras, other kinds of files, a broken one.
#include <OpenImageIO/imageio.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/files/image_io.h"
#include "scene/files/scene_folder.h"
#include "tests/support/bad_input.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kViews = 12;

void WriteWithType(const fs::path& path, const Image8& image, OIIO::TypeDesc type) {
  const auto out = OIIO::ImageOutput::create(path.string());
  ASSERT_TRUE(out && out->open(path.string(), OIIO::ImageSpec(image.width, image.height, image.channels, type)));
  ASSERT_TRUE(out->write_image(OIIO::TypeDesc::UINT8, image.data.data()));
  ASSERT_TRUE(out->close());
}

Image8 Grey(const Image8& rgb) {
  Image8 grey(rgb.width, rgb.height, 1);
  for (std::size_t i = 0; i < grey.data.size(); ++i)
    grey.data[i] = static_cast<std::uint8_t>(
        (rgb.data[3 * i] * 299 + rgb.data[3 * i + 1] * 587 + rgb.data[3 * i + 2] * 114) / 1000);
  return grey;
}

Image8 WithAlpha(const Image8& rgb) {
  Image8 rgba(rgb.width, rgb.height, 4, 255);
  for (std::size_t i = 0; i < rgb.data.size() / 3; ++i)
    for (std::size_t c = 0; c < 3; ++c) rgba.data[4 * i + c] = rgb.data[3 * i + c];
  return rgba;
}

TEST(OddPhotos, SizesDepthsGreyAlphaTextAndABrokenOneInOneFolder) {
  const SimulatedCapture capture("desk", kViews, 480);
  const fs::path photos = capture / "photos", scene = capture / "scene";
  fs::create_directories(photos);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(capture.photos())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  ASSERT_EQ(files.size(), static_cast<std::size_t>(kViews));
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Image8 photo = ReadImage8(files[i]);
    const std::string stem = files[i].stem().string();
    switch (i) {
      case 1: WriteWithType(photos / (stem + ".png"), photo, OIIO::TypeDesc::UINT16); break;
      case 3: WriteWithType(photos / (stem + ".png"), Grey(photo), OIIO::TypeDesc::UINT8); break;
      case 5: WriteWithType(photos / (stem + ".png"), WithAlpha(photo), OIIO::TypeDesc::UINT8); break;
      case 7: WriteImage(photos / (stem + ".jpg"), Resize(photo, photo.width * 3 / 4, photo.height * 3 / 4)); break;
      case 9:  // cut off
        WriteImage(photos / (stem + ".jpg"), photo);
        fs::resize_file(photos / (stem + ".jpg"), fs::file_size(photos / (stem + ".jpg")) / 2);
        break;
      default: WriteImage(photos / (stem + ".jpg"), photo);
    }
  }
  const std::string broken = files[9].stem().string() + ".jpg";
  WriteTextAtomically(photos / "notes.txt", "taken on a Sunday");
  WriteTextAtomically(photos / "list.csv", "a,b\n");
  const std::string before = Contents(photos);

  const ProgramResult result = RunProgram({"lumi-pipeline", photos.string(), "-o", scene.string(), "--holdout", "0",
                                           "--no-video", "--quality", "low", "--proxy-minutes", "0", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Contents(photos), before);
  const json reconstruct = json::parse(result.out)["stages"][0]["summary"];
  EXPECT_EQ(reconstruct["images_total"], kViews);
  EXPECT_EQ(reconstruct["images_registered"], kViews - 1);
  ASSERT_EQ(reconstruct["missing"].size(), 1U) << reconstruct.dump(1);
  EXPECT_EQ(reconstruct["missing"][0]["name"], broken);
  EXPECT_THAT(ReadText(scene / "report.html"), testing::HasSubstr(broken));

  // Each with a picture of its camera's size, as any reader takes it.
  const Scene opened = OpenScene(scene, {}, SilentProgress());
  for (const View& view : opened.views)
    EXPECT_EQ(ReadImage8(opened.ImagePath(view)).width, opened.CameraOf(view).width_px) << view.name;
}

}  // namespace
}  // namespace lumi
