// The fuzz targets, without fuzzing: every finding of earlier runs stays mended, and what mutation starts from is read.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <set>

#include "scene/files/atomic_file.h"
#include "scene/files/scene_folder.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/seeds.h"
#include "tests/support/small_scene.h"

namespace lumi::fuzz {
namespace {
namespace fs = std::filesystem;

// Videos are given by fuzz.sh only: a sound one is made by a program.
const std::set<std::string> kWithoutSeedsHere = {"video"};

class FuzzReplay : public testing::Test {
 protected:
  // A reader that takes memory without end is to fail here, not to take the machine's.
  static void SetUpTestSuite() {
#if !defined(__SANITIZE_ADDRESS__)  // maps terabytes
    rlimit limit{};
    ::getrlimit(RLIMIT_AS, &limit);
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, rlim_t{6} << 30);
    ::setrlimit(RLIMIT_AS, &limit);
#endif
  }
};

std::vector<fs::path> FilesBelow(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
    if (it->is_regular_file()) files.push_back(it->path());
  std::sort(files.begin(), files.end());
  return files;
}

TEST_F(FuzzReplay, EveryTargetReadsItsSeeds) {
  const TemporaryFolder folder;
  WriteScene(MakeSmallScene(folder / "capture/images", 4), folder / "capture");
  WriteSeeds(folder / "capture", folder / "seeds");
  for (const Target& target : Targets()) {
    const auto seeds = FilesBelow(folder / "seeds" / target.name);
    EXPECT_EQ(seeds.empty(), kWithoutSeedsHere.count(target.name) > 0) << target.name;
    for (const fs::path& seed : seeds) EXPECT_TRUE(Accepts(target, ReadText(seed))) << seed;
  }
}

TEST_F(FuzzReplay, EveryFindingStaysMended) {
  const fs::path root = fs::path(LUMI_SOURCE_DIR) / "tests/fuzz/regressions";
  std::size_t replayed = 0;
  for (const Target& target : Targets())
    for (const fs::path& file : FilesBelow(root / target.name)) {
      EXPECT_NO_THROW(Accepts(target, ReadText(file))) << file;
      ++replayed;
    }
  EXPECT_EQ(replayed, FilesBelow(root).size()) << "a folder there is of no target";
}

TEST_F(FuzzReplay, NothingAtAllIsRefusedOrRead) {
  for (const Target& target : Targets())
    for (const std::string bytes : {"", "\n", "{", "{}", "[]", "0"}) EXPECT_NO_THROW(Accepts(target, bytes)) << bytes;
}

// A contract that nothing can break would hold nothing together.
TEST_F(FuzzReplay, ABrokenContractIsSeen) {
  const auto broken = [](void (*read)(std::string_view)) { Accepts({"target", read}, ""); };
  EXPECT_THROW(broken([](std::string_view) { throw std::runtime_error("x"); }), ContractBroken);
  EXPECT_THROW(broken([](std::string_view) { throw MachineError("x"); }), ContractBroken);
  EXPECT_THROW(broken([](std::string_view) { throw InputError("file", ""); }), ContractBroken);
  EXPECT_THROW(broken([](std::string_view) { Require(false, "x"); }), ContractBroken);
  EXPECT_NO_THROW(broken([](std::string_view) { throw InputError("file", "is cut off"); }));
}

}  // namespace
}  // namespace lumi::fuzz
