// A video whose end is missing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "scene/files/image_io.h"
#include "scene/files/video.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

TEST(CutOffVideo, IsUsedAsFarAsItGoes) {
  const SimulatedCapture capture("plaza", 24, 480);
  const fs::path video = capture / "walk.mp4", scene = capture / "scene";
  VideoWriter writer(video, 10);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(capture.photos())) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const fs::path& file : files) writer.Add(ReadImage8(file));
  writer.Finish();
  fs::resize_file(video, fs::file_size(video) * 2 / 3);

  const ProgramResult result = RunProgram({"lumi-pipeline", video.string(), "-o", scene.string(), "--holdout", "0",
                                           "--no-video", "--quality", "low", "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, testing::HasSubstr("walk.mp4 is cut off"));
  const json reconstruct = json::parse(result.out)["stages"][0]["summary"];
  EXPECT_GE(reconstruct["images_registered"].get<int>(), 6);
  EXPECT_LT(reconstruct["images_total"].get<int>(), 24);
}

}  // namespace
}  // namespace lumi
