// What COLMAP prints, read as progress and as option names: captured from 3.8, and from 3.13's help.
#include <gtest/gtest.h>

#include "reconstruct/colmap_log.h"
#include "reconstruct/colmap_program.h"

namespace lumi {
namespace {

TEST(ColmapLog, ReadsTheProgressLinesOfEveryStage) {
  const auto expect = [](const char* line, long done, long total) {
    const auto p = ParseColmapProgress(line);
    ASSERT_TRUE(p) << line;
    EXPECT_EQ(p->done, done) << line;
    EXPECT_EQ(p->total, total) << line;
  };
  expect("Processed file [3/11]", 3, 11);
  expect("Matching block [1/3, 2/3] in 0.363s", 2, 9);
  expect("Matching block [3/3, 3/3]", 9, 9);
  expect("Matching block [5/18] in 0.2s", 5, 18);
  expect("Matching image [5/40] in 0.1s", 5, 40);
  expect("Registering image #5 (3)", 3, 0);
  expect("Undistorting image [2/11]", 2, 11);
  expect("I20250101 10:00:00.000000 123 feature_extraction.cc:259] Processed file [7/9]", 7, 9);
  expect("I20250101 10:00:00.000000 123 pairing.cc:1] Processing block [2/2, 1/2]", 3, 4);
  expect("I20250101 10:00:00.000000 123 mapper.cc:1] Registering image #12 (num_reg_frames=4)", 4, 0);
}

TEST(ColmapLog, OtherLinesAreNoProgress) {
  for (const char* line :
       {"", "  Name:            0001.jpg", "Elapsed time: 0.995 [minutes]", "Processed file [", "Processed file [x/y]",
        "Processed file [12/11]", "Matching block [1/3, 2]", "  => Image sees 3814 / 8854 points",
        "Registering image #5", "TIFFFieldWithTag: Internal error, unknown tag 0xa217."})
    EXPECT_FALSE(ParseColmapProgress(line)) << line;
}

constexpr const char* kHelp38 =
    "COLMAP 3.8 (Commit Unknown on Unknown without CUDA)\n\nOptions can either be specified via command-line or by "
    "defining\n"
    "them in a .ini project file passed to `--project_path`.\n\n  -h [ --help ] \n  --random_seed arg (=0)\n  "
    "--image_list_path arg\n"
    "  --SiftExtraction.use_gpu arg (=1)\n  --SiftExtraction.max_num_features arg (=8192)\n";
constexpr const char* kHelp313 =
    "COLMAP 3.13.0 (Commit abc on 2025-11-07 with CUDA)\n\n  -h [ --help ]\n  --default_random_seed arg (=0)\n  "
    "--image_list_path arg\n"
    "  --FeatureExtraction.type arg (=SIFT)\n  --FeatureExtraction.use_gpu arg (=1)\n  "
    "--FeatureExtraction.max_image_size arg (=3200)\n"
    "  --SiftExtraction.max_num_features arg (=8192)\n  --FeatureMatching.use_gpu arg (=1)\n";

TEST(ColmapOptions, NamesOfTheInstalledVersionAreUsed) {
  const auto old_names = ParseColmapOptionNames(kHelp38), new_names = ParseColmapOptionNames(kHelp313);
  EXPECT_EQ(InstalledOptionName("SiftExtraction.use_gpu", old_names), "SiftExtraction.use_gpu");
  EXPECT_EQ(InstalledOptionName("SiftExtraction.use_gpu", new_names), "FeatureExtraction.use_gpu");
  EXPECT_EQ(InstalledOptionName("SiftMatching.use_gpu", new_names), "FeatureMatching.use_gpu");
  EXPECT_EQ(InstalledOptionName("SiftExtraction.max_num_features", new_names), "SiftExtraction.max_num_features");
  EXPECT_EQ(InstalledOptionName("random_seed", new_names), "default_random_seed");
  EXPECT_EQ(InstalledOptionName("image_list_path", new_names), "image_list_path");
  EXPECT_FALSE(InstalledOptionName("SiftExtraction.max_image_size", old_names));  // not in that excerpt
  EXPECT_FALSE(InstalledOptionName("no_such_option", new_names));
}

TEST(ColmapOptions, OnlyOptionsAreRead) {
  const auto names = ParseColmapOptionNames(kHelp38);
  EXPECT_EQ(names.count("help"), 1u);
  EXPECT_EQ(names.count("arg"), 0u);
  EXPECT_EQ(names.size(),
            5u);  // help, random_seed, image_list_path and two of Sift; not the `--project_path` in the prose
}

TEST(ColmapOptions, NoTextHasNone) {
  EXPECT_TRUE(ParseColmapOptionNames(std::string(kHelp38) + '\x01').empty());
  EXPECT_TRUE(ParseColmapOptionNames(std::string("\0 --x \0", 7)).empty());
  EXPECT_FALSE(ParseColmapOptionNames("  --a\ttab\r\n").empty());
}

}  // namespace
}  // namespace lumi
