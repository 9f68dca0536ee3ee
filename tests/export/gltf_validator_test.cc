// What lumi-export gltf writes, by Khronos' own validator (npm's gltf-validator; for people who run all tests).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "scene/files/atomic_file.h"
#include "scene/program/subprocess.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

constexpr const char* kValidate = R"(
const fs = require("fs"), validator = require("gltf-validator");
validator.validateBytes(new Uint8Array(fs.readFileSync(process.argv[2]))).then(
  (report) => console.log(JSON.stringify(report)), (error) => { console.error(error); process.exit(1); });
)";

TEST(GltfValidator, FindsNothing) {
  const auto npm = FindProgram("npm"), node = FindProgram("node");
  if (!npm || !node) GTEST_SKIP() << "node and npm are not installed";
  const SimulatedCapture capture("desk", 6, 160);
  const fs::path folder = capture / "validator";
  fs::create_directories(folder);
  const SubprocessOptions quiet{.on_line = nullptr, .separate_stdout = true, .environment = {}, .log_file = {}};
  if (RunSubprocess({npm->string(), "install", "--silent", "--no-audit", "--no-fund", "--prefix", folder.string(),
                     "gltf-validator"},
                    quiet)
          .exit_code != 0)
    GTEST_SKIP() << "npm cannot fetch gltf-validator here";
  WriteTextAtomically(folder / "validate.js", kValidate);
  // The proxy that the capture has, and a plane, whose vertices hardly any photo sees.
  ASSERT_EQ(RunProgram({"lumi-proxy", "plane", capture.path().string(), "--quiet"}).exit_code, 0);
  for (const char* proxy : {"truth", "plane"}) {
    const fs::path glb = folder / (std::string(proxy) + ".glb");
    const ProgramResult made =
        RunProgram({"lumi-export", "gltf", capture.path().string(), "-o", glb.string(), "--proxy", proxy, "--quiet"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const auto run = RunSubprocess({node->string(), (folder / "validate.js").string(), glb.string()}, quiet);
    ASSERT_EQ(run.exit_code, 0) << run.out;
    const auto report = nlohmann::json::parse(run.out);
    EXPECT_EQ(report["issues"]["numErrors"], 0) << report["issues"].dump(1);
    EXPECT_EQ(report["issues"]["numWarnings"], 0) << report["issues"].dump(1);
    EXPECT_EQ(report["info"]["totalVertexCount"].get<int>() > 0, true);
    EXPECT_EQ(report["mimeType"], "model/gltf-binary");
  }
}

}  // namespace
}  // namespace lumi
