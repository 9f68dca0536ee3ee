#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "tests/architecture/tree_rules.h"

namespace lumi {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;

TEST(Architecture, TheTreeKeepsItsArrows) { EXPECT_THAT(BrokenRules(LUMI_SOURCE_DIR), IsEmpty()); }

// The rules themselves, on trees that break one each.
std::vector<std::string> RulesBrokenBy(const std::string& file, const std::string& text) {
  const TemporaryFolder root;
  WriteTextAtomically(root / file, text);
  return BrokenRules(root.path());
}

TEST(Architecture, ArrowsAgainstTheDirectionAreSeen) {
  EXPECT_THAT(RulesBrokenBy("scene/model/a.h", "#include <vector>\n#include \"render/renderer.h\"\n"),
              ElementsAre(StartsWith("scene/model/a.h:2:")));
  EXPECT_THAT(RulesBrokenBy("proxy/a.cc", "#include \"reconstruct/colmap.h\"\n"),
              ElementsAre(StartsWith("proxy/a.cc:1: a stage uses itself")));
  EXPECT_THAT(RulesBrokenBy("pipeline/a.cc", "#include \"render/renderer.h\"\n"),
              ElementsAre(StartsWith("pipeline/a.cc:1:")));
  EXPECT_THAT(RulesBrokenBy("proxy/a.cc", "#include \"tests/scene/x.h\"\n"), ElementsAre(StartsWith("proxy/a.cc:1:")));
  EXPECT_THAT(RulesBrokenBy("python/core/a.cc", "#include \"render/b.h\"\n#include <pybind11/stl.h>\n"), IsEmpty());
  EXPECT_THAT(RulesBrokenBy("python/core/a.cc", "#include \"proxy/b.h\"\n"),
              ElementsAre(StartsWith("python/core/a.cc:1:")));
  EXPECT_THAT(RulesBrokenBy("render/a.cc", "#include <pybind11/stl.h>\n"),
              ElementsAre(StartsWith("render/a.cc:1: pybind11")));
  EXPECT_THAT(RulesBrokenBy("proxy/a.cc", "#include \"proxy/b.h\"\n#include \"scene/model/scene.h\"\n"), IsEmpty());
}

TEST(Architecture, TheRadianceCoreIsKeptPure) {
  for (const char* header :
       {"<epoxy/gl.h>", "<thread>", "<fstream>", "\"scene/files/mesh_io.h\"", "\"scene/program/parallel.h\""})
    EXPECT_THAT(RulesBrokenBy("render/radiance/a.cc", std::string("#include ") + header + "\n"),
                ElementsAre(StartsWith("render/radiance/a.cc:1:")))
        << header;
  EXPECT_THAT(RulesBrokenBy("render/radiance/a.cc", "#include \"cmake/embree.h\"\n"), IsEmpty());
  EXPECT_THAT(RulesBrokenBy("proxy/a.cc", "#include \"cmake/embree.h\"\n"),
              ElementsAre(StartsWith("proxy/a.cc:1: Embree")));
}

TEST(Architecture, HeavyLibrariesStayInTheirStage) {
  EXPECT_THAT(RulesBrokenBy("scene/a.cc", "#include <CGAL/Delaunay_triangulation_3.h>\n"),
              ElementsAre(StartsWith("scene/a.cc:1: CGAL")));
  EXPECT_THAT(RulesBrokenBy("proxy/a.cc", "#include <GLFW/glfw3.h>\n"),
              ElementsAre(StartsWith("proxy/a.cc:1: OpenGL")));
  EXPECT_THAT(RulesBrokenBy("scene/files/a.cc", "#include <libavcodec/avcodec.h>\n"),
              ElementsAre(StartsWith("scene/files/a.cc:1: FFmpeg")));
  EXPECT_THAT(RulesBrokenBy("scene/a.h", "#include <opencv2/core.hpp>\n"),
              ElementsAre(StartsWith("scene/a.h:1: headers of scene")));
  for (const char* frame : {"#include <CLI/CLI.hpp>\n", "#include \"scene/program/main_program.h\"\n"})
    EXPECT_EQ(RulesBrokenBy("proxy/a.cc", frame).size(), 1U) << frame;
  EXPECT_THAT(RulesBrokenBy("proxy/main.cc", "#include <CLI/CLI.hpp>\n"),
              ElementsAre(StartsWith("proxy/main.cc:1: CLI11")));
  EXPECT_THAT(RulesBrokenBy("proxy/main.cc", "#include \"scene/program/main_program.h\"\n"), IsEmpty());
}

TEST(Architecture, LibrariesThatPrintOrExitAreSeen) {
  for (const char* text :
       {"  std::cout << 1;", "  fmt::print(\"x\");", "  std::exit(1);", "  printf(\"x\");", "  if (x) exit(1);"})
    EXPECT_EQ(RulesBrokenBy("proxy/a.cc", std::string(text) + "\n").size(), 1U) << text;
  for (const char* text :
       {"  // printf( is not used here", "  std::snprintf(buffer, 3, \"x\");", "  _exit(1);", "  on_exit_(1);"})
    EXPECT_THAT(RulesBrokenBy("proxy/a.cc", std::string(text) + "\n"), IsEmpty()) << text;
  EXPECT_THAT(RulesBrokenBy("proxy/main.cc", "  fmt::print(\"x\");\n"), IsEmpty());
}

TEST(Architecture, PathsOfOneMachineAreSeen) {
  EXPECT_EQ(RulesBrokenBy("proxy/a.cc",
                          "  Read(\"/ho"
                          "me/me/data\");\n")
                .size(),
            1U);
  EXPECT_EQ(RulesBrokenBy("proxy/a.cc", "  Read(\"" LUMI_SOURCE_DIR "/x\");\n").size(), 1U);
  EXPECT_THAT(RulesBrokenBy("proxy/a.cc", "  Read(\"/proc/self/exe\");\n"), IsEmpty());
}

}  // namespace
}  // namespace lumi
