// lumi-pipeline --print-commands: the stages' own commands, run by hand, make the same scene; one may be exchanged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "scene/files/atomic_file.h"
#include "scene/program/shell_word.h"
#include "tests/support/child_program.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::string Replaced(std::string text, const std::string& what, const std::string& with) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += with.size())
    text.replace(at, what.size(), with);
  return text;
}

// Each line as a shell's command, with the programs of this build in PATH. Comments do nothing.
void RunByHand(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    const ProgramResult result = RunProgram({"/bin/sh", "-c", "PATH=" LUMI_BIN_DIR ":$PATH; " + line});
    ASSERT_EQ(result.exit_code, 0) << line << "\n" << result.err;
  }
}

TEST(StageCommands, RunByHandTheyMakeThePipelinesBytes) {
  const SimulatedCapture capture("desk", 12, 160);
  const fs::path scene = capture / "the scene", other = capture / "the other", third = capture / "third";
  const std::vector<std::string> argv{"lumi-pipeline",
                                      capture.photos().string(),
                                      "-o",
                                      scene.string(),
                                      "--poses",
                                      (capture.path() / "truth").string(),
                                      "--proxy",
                                      "delaunay",
                                      "--holdout",
                                      "4",
                                      "--width",
                                      "96",
                                      "--seconds",
                                      "1",
                                      "--threads",
                                      "2",
                                      "--print-commands"};
  const ProgramResult run = RunProgram(argv);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("delaunay was made of all photos")) << "what flatters the figures is said";
  std::vector<std::string> lines = LinesOf(run.out);
  ASSERT_EQ(lines.size(), 6U) << run.out;
  EXPECT_THAT(lines[0], testing::StartsWith("lumi-reconstruct "));
  EXPECT_THAT(lines[1], testing::StartsWith("lumi-proxy delaunay "));
  EXPECT_EQ(lines[5], "# report: lumi-pipeline itself");
  // The same are told by a run that has nothing left to do.
  EXPECT_EQ(RunProgram(argv).out, run.out);

  const auto of = [&](const fs::path& folder) {
    std::vector<std::string> changed;
    for (const std::string& line : lines) changed.push_back(Replaced(line, scene.string(), folder.string()));
    return changed;
  };
  RunByHand(of(other));
  int compared = 0;
  for (const char* part : {"proxies/delaunay.ply", "sparse", "holdout", "fly-through.mp4"})
    for (const fs::path& file : fs::is_directory(scene / part)
                                    ? std::vector<fs::path>(fs::recursive_directory_iterator(scene / part), {})
                                    : std::vector<fs::path>{scene / part}) {
      if (!fs::is_regular_file(file) || file.extension() == ".json") continue;
      const fs::path same = other / file.lexically_relative(scene);
      ASSERT_TRUE(fs::exists(same)) << same;
      EXPECT_EQ(ReadText(file), ReadText(same)) << file;
      ++compared;
    }
  EXPECT_GT(compared, 6);

  // A mesh of one's own in the place of the proxy's stage.
  std::vector<std::string> exchanged = of(third);
  exchanged[1] = "lumi-proxy import " + ShellWord((other / "proxies/delaunay.ply").string()) + " " +
                 ShellWord(third.string()) + " --name mine --activate";
  RunByHand(exchanged);
  EXPECT_EQ(ReadText(third / "fly-through.mp4"), ReadText(scene / "fly-through.mp4"));
  EXPECT_THAT(ReadText(third / "holdout/render.json"), HasSubstr("\"proxy\": \"mine\""));
}

TEST(StageCommands, AreOfOneScene) {
  const ProgramResult refused =
      RunProgram({"lumi-pipeline", "x", "-o", "y.mp4", "--stabilize", "smooth", "--print-commands"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("--print-commands"));
}

}  // namespace
}  // namespace lumi
