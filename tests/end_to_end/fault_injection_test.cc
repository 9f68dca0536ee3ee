// Each call on a file that a program makes fails once, and so does each kind of allocation: the program says so in one
// line, ends with the contract's exit code, leaves nothing half-written and nothing of the user's changed, and a second
// run makes what an undisturbed one makes.
#include "tests/support/fault_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "scene/files/atomic_file.h"
#include "scene/files/json_keys.h"
#include "scene/files/provenance.h"
#include "scene/program/subprocess.h"
#include "tests/support/bad_input.h"
#include "tests/support/same_outputs.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;

// Every call on a file, and of the call stacks that allocate and that no earlier case had (there are thousands) so
// many, or what the environment variable LUMI_STACKS says; or a few of each. LUMI_STACKS=i/n: of all of them every nth
// from the ith on, and no call on a file; n such runs, side by side or one after the other, are all stacks.
constexpr std::size_t kMostStacks = 150;
struct Part {
  std::size_t i = 0, n = 1;
};
std::optional<Part> PartOfStacks() {
  const std::string stacks = std::getenv("LUMI_STACKS") ? std::getenv("LUMI_STACKS") : "";
  const auto slash = stacks.find('/');
  if (slash == std::string::npos) return std::nullopt;
  const Part part{std::stoul(stacks), std::stoul(stacks.substr(slash + 1))};
  if (part.i >= part.n) throw std::invalid_argument("LUMI_STACKS=i/n: i is 0 ... n - 1");
  return part;
}
std::size_t MostFaults(FaultKind kind) {
  if (FewFaults()) return kind == FaultKind::kWrite ? 3 : 1;
  if (kind != FaultKind::kMemory) return std::numeric_limits<std::size_t>::max();
  const char* stacks = std::getenv("LUMI_STACKS");
  return stacks && !PartOfStacks() ? std::stoul(stacks) : kMostStacks;
}

// Of the same build and the same part of stacks, those that are not swept again: LUMI_SWEPT=FILE has a line each, and
// gets those of cases that pass.
fs::path SweptFile() {
  const char* const file = std::getenv("LUMI_SWEPT");
  return file ? fs::path(file) : fs::path();
}

constexpr int kNobody = 1 << 30;  // beyond the kernel's largest number of a process

std::vector<long> PointsOf(FaultKind kind, const std::vector<long>& points) {
  const std::optional<Part> part = kind == FaultKind::kMemory ? PartOfStacks() : std::nullopt;
  if (!part) return SomePoints(points, MostFaults(kind));
  std::vector<long> some;
  for (std::size_t i = part->i; i < points.size(); i += part->n) some.push_back(points[i]);
  return some;
}

// What a program is run on, and what it may touch.
struct FaultCase {
  std::vector<std::string> argv;    // "@" is the folder of the run
  std::vector<std::string> inputs;  // paths in it that are only read
  // Files that hold something else while a chain of steps is under way: each is whole all the same.
  std::vector<std::string> in_steps = {};
  std::string counts_work = {};  // a file that says what this run did: one that goes on does less
  bool is_slow = false;          // seconds a run: with few faults only those of writing
  // Files of times that were measured, and what follows from them: there or not, but no two runs write the same.
  std::vector<std::string> measured = {};
};

class FaultInjection : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<TemporaryFolder>();
    std::ifstream swept(SweptFile());
    for (std::string stack; std::getline(swept, stack);) stacks_.insert(stack);
    const fs::path capture = Template() / "capture";
    Make({"lumi-simulate", "--example", "desk", "--views", "4", "--width", "64", "-o", capture.string()});
    // A scene with proxies of its own, and a workspace as COLMAP leaves one.
    fs::copy(capture, Template() / "scene", fs::copy_options::recursive);
    fs::remove_all(Template() / "scene/truth");
    Make({"lumi-proxy", "hull", (Template() / "scene").string(), "--silhouettes",
          (capture / "truth/silhouettes").string(), "--cell-px", "16", "--activate"});
    Make({"lumi-proxy", "delaunay", (Template() / "scene").string(), "--name", "sparse"});
    fs::create_directories(Template() / "workspace");
    fs::copy(capture / "images", Template() / "workspace/images", fs::copy_options::recursive);
    fs::copy(capture / "sparse", Template() / "workspace/sparse", fs::copy_options::recursive);
    // Photos with enough to see for COLMAP, and what it found in them.
    const fs::path taken = Template() / "taken", scene = *folder_ / "reconstructed";
    Make({"lumi-simulate", "--example", "desk", "--views", "4", "--width", "240", "-o", taken.string()});
    Make({"lumi-reconstruct", (taken / "images").string(), "-o", scene.string(), "--poses",
          (taken / "truth/sparse").string(), "--quality", "low"});
    fs::copy(scene / "colmap/database.db", Template() / "database.db");
    Make({"lumi-simulate", "--example", "boards", "--width", "320", "-o", (*folder_ / "boards").string()});
    fs::copy(*folder_ / "boards/images", Template() / "boards");
    // Films: a walk with its cameras, something that turns from a tripod and from a waved camera.
    const fs::path walk = *folder_ / "walk", lamp = *folder_ / "lamp";
    Make({"lumi-simulate", "--example", "hallway", "--video", "--views", "24", "--width", "96", "-o", walk.string()});
    fs::remove_all(walk / "truth");
    fs::copy(walk, Template() / "walk", fs::copy_options::recursive);
    Make({"lumi-simulate", "--example", "helicopter", "--video", "--views", "60", "--width", "48", "--fixed-frames",
          "60", "-o", lamp.string()});
    fs::copy(lamp / "fixed.mp4", Template() / "fixed.mp4");
    fs::copy(lamp / "video.mp4", Template() / "waved.mp4");
    fs::copy(lamp, Template() / "turning", fs::copy_options::recursive);
    const SubprocessResult film = RunSubprocess(
        {"ffmpeg", "-v", "error", "-y", "-f", "lavfi", "-i", "color=c=gray:s=160x120:r=30:d=0.4", "-f", "lavfi", "-i",
         "sine=frequency=440:duration=0.4", "-c:v", "mpeg4", (Template() / "film.mp4").string()});
    ASSERT_EQ(film.exit_code, 0) << testing::PrintToString(film.tail);
  }
  static void TearDownTestSuite() {
    folder_.reset();
    std::cout << "faults injected in all: " << injected_ << " (" << harmless_ << " of them did not matter)\n";
  }

  static void Make(const std::vector<std::string>& argv) {
    const ProgramResult made = RunProgram(argv);
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  static fs::path Template() { return *folder_ / "template"; }
  static fs::path Work() { return *folder_ / "work"; }

  // The folder as it is before the run: of the template, what the run is given.
  static void Reset(const FaultCase& c) {
    fs::remove_all(Work());
    fs::create_directories(Work());
    std::set<fs::path> given;
    for (const std::string& a : c.argv)
      if (a.starts_with("@/")) given.insert(*fs::path(a.substr(2)).begin());
    for (const std::string& input : c.inputs) given.insert(*fs::path(input).begin());
    for (const fs::path& name : given)
      if (fs::exists(Template() / name)) fs::copy(Template() / name, Work() / name, fs::copy_options::recursive);
  }
  static std::vector<std::string> Arguments(const FaultCase& c) {
    std::vector<std::string> argv = c.argv;
    for (std::string& a : argv)
      for (auto at = a.find("@/"); at != std::string::npos; at = a.find("@/")) a.replace(at, 1, Work().string());
    // One thread: the calls then come in one order.
    for (const char* more : {"--threads", "1", "--quiet"}) argv.emplace_back(more);
    return argv;
  }

  // What the folder of the run holds; of what was measured only that it is whole: JSON that can be parsed.
  static std::map<std::string, std::string> Files(const FaultCase& c) {
    auto files = ComparableFiles(Work());
    for (auto& [name, hash] : files)
      if (std::ranges::any_of(c.measured, [&file = name](const std::string& m) { return file.starts_with(m); })) {
        const std::string text = ReadText(Work() / name);
        hash = text.empty() || (name.ends_with(".json") && !JsonKeys::Parse(text)) ? "cut off" : "measured";
      }
    return files;
  }

  // The allocations whose call stacks no case of this program before had.
  static std::vector<long> NewStacks(const std::string& program, const FaultRun& counted) {
    std::vector<long> points;
    for (std::size_t i = 0; i < counted.points.size(); ++i)
      if (IsNew(program + " " + counted.calls[i])) points.push_back(counted.points[i]);
    return points;
  }
  // Those of `counted` that `served` lacks: of libraries while they are loaded, alike in all programs.
  static std::vector<long> NewStacksOfLoading(const FaultRun& counted, const FaultRun& served) {
    const std::set<std::string> known(served.calls.begin(), served.calls.end());
    std::vector<long> points;
    for (std::size_t i = 0; i < counted.points.size(); ++i)
      if (!known.contains(counted.calls[i]) && IsNew("loading " + counted.calls[i]))
        points.push_back(counted.points[i]);
    return points;
  }
  static bool IsNew(const std::string& stack) {
    if (!stacks_.insert(stack).second) return false;
    new_stacks_.push_back(stack);
    return true;
  }
  void KeepSwept() {
    if (PartOfStacks() && !SweptFile().empty() && !HasFailure()) {
      std::ofstream swept(SweptFile(), std::ios::app);
      for (const std::string& stack : new_stacks_) swept << stack << "\n";
    }
    new_stacks_.clear();
  }

  // Beside each file that the program writes lies what a killed run left of it: the next run removes it.
  void PlantTemporaries(const FaultCase& c) {
    const std::vector<std::string> argv = Arguments(c);
    Reset(c);
    const auto before = Files(c);
    ASSERT_EQ(RunProgram(argv).exit_code, 0);
    const auto wanted = Files(c);
    Reset(c);
    std::vector<fs::path> planted;
    for (const auto& [name, hash] : wanted) {
      const fs::path file = Work() / name, folder = file.parent_path();
      const auto it = before.find(name);
      const bool is_written = it == before.end() || it->second != hash;
      if (is_written && (fs::exists(folder) || folder.parent_path() == Work()))  // else a folder that nobody knows
        planted.push_back(folder / ("." + file.stem().string().substr(0, 180) + ".lumi-tmp-" + std::to_string(kNobody) +
                                    "-0" + file.extension().string()));
    }
    for (const fs::path& temporary : planted) WriteTextAtomically(temporary, "half");
    if (planted.empty()) return;  // all in folders that are not there yet
    EXPECT_NE(TemporariesIn(Work()), "");
    const ProgramResult run = RunProgram(argv);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(TemporariesIn(Work()), "");
    EXPECT_EQ(FirstDifference(wanted, Files(c)), "");
  }

  void Sweep(const FaultCase& c, FaultKind kind) {
    const std::vector<std::string> argv = Arguments(c);
    Reset(c);
    const auto before = Files(c);
    const FaultRun counted = RunWithFault(argv, kind, 0, Work());
    ASSERT_EQ(counted.result.exit_code, 0) << counted.result.err;
    const auto wanted = Files(c);
    EXPECT_FALSE(counted.points.empty());
    // States after which the next run was seen to do right.
    std::set<std::map<std::string, std::string>> mended;
    Reset(c);
    const auto fresh = WholeState(Work());
    auto state = fresh;
    int failed = 0, harmless = 0, crashed = 0;
    std::vector<long> points = counted.points, served;
    std::unique_ptr<FaultServer> server;
    if (kind == FaultKind::kMemory) {
      server = std::make_unique<FaultServer>(argv, Work());
      const FaultRun counted_there = server->Run(0);
      ASSERT_EQ(counted_there.result.exit_code, 0) << counted_there.result.err;
      EXPECT_EQ(FirstDifference(wanted, Files(c)), "");
      points = NewStacksOfLoading(counted, counted_there);
      served = NewStacks(c.argv[0], counted_there);
      state.clear();
    }
    const std::size_t all = points.size() + served.size();
    points = PointsOf(kind, points);
    served = PointsOf(kind, served);
    for (std::size_t i = 0; i < points.size() + served.size(); ++i) {
      const bool is_served = i >= points.size();
      const long at = is_served ? served[i - points.size()] : points[i];
      if (state != fresh) Reset(c);
      std::map<std::string, std::string> inputs;
      for (const std::string& input : c.inputs) inputs[input] = Contents(Work() / input);
      const FaultRun run = is_served ? server->Run(at) : RunWithFault(argv, kind, at, Work());
      state = WholeState(Work());
      SCOPED_TRACE("fault " + std::to_string(at) + ": " + run.failed + "\n" + run.result.err + run.stack);
      if (run.failed.empty()) continue;
      ++failed;
      for (const auto& [input, contents] : inputs) EXPECT_EQ(Contents(Work() / input), contents) << input;
      // Where memory runs out inside a library's function that may not throw, the next run removes what is left.
      if (kind != FaultKind::kMemory) {
        EXPECT_EQ(TemporariesIn(Work()), "");
      }
      const auto found = Files(c);
      if (run.result.exit_code == 0) {
        ++harmless;
        EXPECT_EQ(FirstDifference(wanted, found), "");
        if (HasFailure()) break;
        continue;
      }
      ExpectOneLine(run.result, argv[0], kind);
      if (!run.crash.empty()) ++crashed;
      EXPECT_FALSE(CrashIsOurs(run.crash)) << run.crash;
      ExpectWhole(c, before, wanted, found);
      if (!HasFailure() && mended.contains(state)) continue;
      const auto left = state;
      state.clear();  // by the next run
      const ProgramResult again = is_served ? server->Run(FaultServer::kNone).result : RunProgram(argv);
      EXPECT_EQ(again.exit_code, 0) << again.err;
      EXPECT_EQ(TemporariesIn(Work()), "");
      auto after = Files(c);
      if (!c.counts_work.empty()) after[c.counts_work] = wanted.at(c.counts_work);
      EXPECT_EQ(FirstDifference(wanted, after), "");
      if (HasFailure()) break;  // the first is enough to begin with
      mended.insert(left);
    }
    const char* const what = kind == FaultKind::kMemory ? "memory" : kind == FaultKind::kRead ? "reading" : "writing";
    std::cout << c.argv[0] << " " << c.argv[1] << ", " << what << ": " << failed << " faults of " << all << " ("
              << counted.points.size() << " with those of other cases), " << harmless << " of them harmless, "
              << crashed << " ended by a crash of a library" << std::endl;
    KeepSwept();
    injected_ += failed;
    harmless_ += harmless;
  }

  // Whether the first frame beyond the C library is of a program or library of this suite.
  static bool CrashIsOurs(const std::string& stack) {
    std::istringstream lines(stack);
    for (std::string line; std::getline(lines, line);)
      if (line.starts_with('/') && line.find("fault_injection") == std::string::npos &&
          line.find("/libc.so") == std::string::npos)
        return line.find("/bin/lumi-") != std::string::npos || line.find("liblumi_") != std::string::npos;
    return false;
  }

  static void ExpectOneLine(const ProgramResult& result, const std::string& program, FaultKind kind) {
    EXPECT_TRUE(result.exit_code == 4 || (result.exit_code == 3 && kind == FaultKind::kRead)) << result.exit_code;
    const std::vector<std::string> lines = result.ErrorLines();
    ASSERT_FALSE(lines.empty());
    EXPECT_THAT(lines.back(), testing::StartsWith(program + ": "));
    EXPECT_EQ(std::ranges::count_if(lines, [&](const auto& line) { return line.starts_with(program + ": "); }), 1);
    if (kind == FaultKind::kMemory) {
      EXPECT_THAT(lines.back(), testing::HasSubstr("memory"));
    }
  }

  // Every file is as it was, or as an undisturbed run leaves it; one in a folder that still waits to take another's
  // place (images.part) as it will be there.
  static void ExpectWhole(const FaultCase& c, const std::map<std::string, std::string>& before,
                          const std::map<std::string, std::string>& wanted,
                          const std::map<std::string, std::string>& found) {
    const auto is = [](const auto& files, const auto& file) {
      std::string name = file.first;
      if (const auto part = name.find(".part/"); part != std::string::npos) name.erase(part, 5);
      const auto it = files.find(name);
      return it != files.end() && it->second == file.second;
    };
    for (const auto& file : found) {
      const bool in_steps = std::ranges::any_of(
          c.in_steps, [&](const std::string& name) { return file.first.find(name) != std::string::npos; });
      const fs::path path = Work() / file.first;
      if (path.parent_path().filename() == "provenance" && ReadText(path).find("unfinished") != std::string::npos)
        continue;
      EXPECT_TRUE(in_steps || is(before, file) || is(wanted, file)) << file.first << " is neither old nor new";
    }
  }

  void SweepAll(const FaultCase& c) {
    if (PartOfStacks()) return Sweep(c, FaultKind::kMemory);
    PlantTemporaries(c);
    for (const FaultKind kind : {FaultKind::kWrite, FaultKind::kRead, FaultKind::kMemory})
      if (!HasFailure() && !(c.is_slow && FewFaults() && kind != FaultKind::kWrite)) Sweep(c, kind);
  }

  static std::unique_ptr<TemporaryFolder> folder_;
  static int injected_, harmless_;
  static std::set<std::string> stacks_;
  static std::vector<std::string> new_stacks_;  // of the case that runs
};
std::unique_ptr<TemporaryFolder> FaultInjection::folder_;
std::set<std::string> FaultInjection::stacks_;
std::vector<std::string> FaultInjection::new_stacks_;
int FaultInjection::injected_ = 0;
int FaultInjection::harmless_ = 0;

// Losing power after the record is on the disk loses none of the outputs that it names.
TEST_F(FaultInjection, TheRecordOfAStageComesAfterItsOutputsAreOnTheDisk) {
  const auto flushed_before = [](const FaultRun& run, const fs::path& record, const std::string& call) {
    const auto& calls = run.calls;
    const auto last = std::find(calls.rbegin(), calls.rend(), "rename " + record.string());
    const auto flush = std::find(calls.rbegin(), calls.rend(), call);
    return last != calls.rend() && flush != calls.rend() && last < flush;
  };
  const FaultCase hull{{"lumi-proxy", "hull", "@/scene", "--silhouettes", "@/capture/truth/silhouettes", "--cell-px",
                        "16", "--name", "again"},
                       {}};
  Reset(hull);
  const FaultRun few = RunWithFault(Arguments(hull), FaultKind::kWrite, 0, Work());
  for (const char* written : {"proxies/again.ply", "proxies/again.json", "proxies"})
    EXPECT_TRUE(flushed_before(few, Work() / "scene/provenance/proxy-again.json",
                               "fsync " + (Work() / "scene" / written).lexically_normal().string()))
        << written << "\n"
        << testing::PrintToString(few.calls);
  const FaultRun many = RunWithFault(
      Arguments({{"lumi-simulate", "--example", "desk", "--views", "24", "--width", "16", "-o", "@/new"}, {}}),
      FaultKind::kWrite, 0, Work());
  EXPECT_TRUE(flushed_before(many, Work() / "new/provenance/simulate.json", "syncfs " + (Work() / "new").string()));
}

// What a scene holds, some stage's record names; but for what each run checks by itself and may make anew.
TEST_F(FaultInjection, TheRecordsOfASceneNameAllItsFiles) {
  Reset({{}, {"workspace", "capture"}});
  const std::string scene = (Work() / "new").string();
  Make({"lumi-pipeline", (Work() / "workspace").string(), "-o", scene, "--proxy", "auto", "--proxy-minutes", "0.05",
        "--holdout", "2", "--width", "32", "--seconds", "0.1"});
  Make({"lumi-proxy", "delaunay", scene});
  Make({"lumi-proxy", "dense", scene, "--width", "64", "--iterations", "1"});
  Make({"lumi-proxy", "hull", scene, "--silhouettes", (Work() / "capture/truth/silhouettes").string(), "--cell-px",
        "16"});
  Make({"lumi-proxy", "hull", scene, "--silhouettes", (Work() / "capture/truth/silhouettes").string(), "--cell-px",
        "16", "--tradeoff"});
  Make({"lumi-proxy", "simplify", scene, "--from", "delaunay", "--tradeoff", "--table-faces", "100", "--holdout", "2",
        "--choose-width", "32"});
  Make({"lumi-render", "tradeoff", scene, "-o", (Work() / "measured").string(), "--quick", "--width", "32", "--holdout",
        "2"});
  std::set<std::string> named;
  for (const auto& entry : fs::directory_iterator(Work() / "new/provenance")) {
    if (entry.path().extension() != ".json") continue;
    const auto record = ReadProvenance(scene, entry.path().stem().string());
    ASSERT_TRUE(record) << entry.path();
    for (const auto& [output, fingerprint] : record->outputs)
      named.insert(fs::path(output).lexically_normal().string());
  }
  const auto is_named = [&](fs::path name) {
    for (; !name.empty(); name = name.parent_path())
      if (named.contains(name.string())) return true;
    return false;
  };
  for (const auto& entry : fs::recursive_directory_iterator(scene)) {
    const fs::path name = entry.path().lexically_relative(scene);
    const bool made_anew = *name.begin() == "provenance" || *name.begin() == "small-photos" ||
                           name.parent_path() == fs::path("stereo/planes");
    if (entry.is_regular_file() && !made_anew) {
      EXPECT_TRUE(is_named(name)) << name;
    }
  }
}

TEST_F(FaultInjection, Simulate) {
  SweepAll({{"lumi-simulate", "--example", "desk", "--views", "2", "--width", "32", "-o", "@/new"}, {"capture"}});
}
TEST_F(FaultInjection, ProxyPlane) { SweepAll({{"lumi-proxy", "plane", "@/scene", "--activate"}, {"scene/images"}}); }
TEST_F(FaultInjection, ProxyPlanes) { SweepAll({{"lumi-proxy", "planes", "@/scene"}, {"scene/images"}}); }
TEST_F(FaultInjection, ProxyDelaunay) { SweepAll({{"lumi-proxy", "delaunay", "@/scene"}, {"scene/images"}}); }
TEST_F(FaultInjection, ProxyHull) {
  SweepAll({{"lumi-proxy", "hull", "@/scene", "--silhouettes", "@/capture/truth/silhouettes", "--cell-px", "16",
             "--name", "again"},
            {"scene/images", "capture"}});
}
TEST_F(FaultInjection, ProxySimplify) {
  SweepAll({{"lumi-proxy", "simplify", "@/scene", "--from", "sparse", "--faces", "100"}, {"scene/images"}});
}
TEST_F(FaultInjection, ProxySilhouettes) {
  SweepAll({{"lumi-proxy", "silhouettes", "@/scene", "--masks", "@/capture/truth/silhouettes"},
            {"scene/images", "capture"}});
}
TEST_F(FaultInjection, ProxyImport) {
  SweepAll({{"lumi-proxy", "import", "@/capture/truth/mesh.ply", "@/scene"}, {"scene/images", "capture"}});
}
TEST_F(FaultInjection, RenderHoldout) {
  SweepAll({{"lumi-render", "@/scene", "-o", "@/holdout", "--holdout", "2"}, {"scene"}, {"render.json"}});
}
TEST_F(FaultInjection, RenderFrames) {
  SweepAll({{"lumi-render", "@/scene", "-o", "@/frames", "--seconds", "0.1", "--width", "48"},
            {"scene"},
            {"render.json"},
            "frames/render.json"});
}
TEST_F(FaultInjection, RenderVideo) {
  SweepAll({{"lumi-render", "@/scene", "-o", "@/film.mp4", "--seconds", "0.1", "--width", "48"}, {"scene"}});
}
TEST_F(FaultInjection, ExportWeb) {
  SweepAll({{"lumi-export", "web", "@/scene", "-o", "@/page.html", "--as-scene", "@/page-data"}, {"scene"}});
}
TEST_F(FaultInjection, ExportWebFolder) {
  SweepAll({{"lumi-export", "web", "@/scene", "-o", "@/page", "--proxy", "sparse"}, {"scene"}});
}
TEST_F(FaultInjection, ExportGltf) {
  SweepAll({{"lumi-export", "gltf", "@/scene", "-o", "@/model.glb", "--points", "@/points.ply"}, {"scene"}});
}
TEST_F(FaultInjection, Reconstruct) {
  SweepAll({{"lumi-reconstruct", "@/taken/images", "-o", "@/new", "--poses", "@/taken/truth/sparse", "--database",
             "@/database.db"},
            {"taken", "database.db"},
            {"provenance/"}});
}
TEST_F(FaultInjection, ReconstructFindsAndMatchesFeatures) {
  SweepAll(
      {{"lumi-reconstruct", "@/taken/images", "-o", "@/new", "--poses", "@/taken/truth/sparse", "--quality", "low"},
       {"taken"},
       {"provenance/"},
       "",
       true});
}
TEST_F(FaultInjection, ReconstructByFactorization) {
  SweepAll({{"lumi-reconstruct", "@/walk/video.mp4", "-o", "@/new", "--backend", "factorization", "--projective",
             "--all-frames"},
            {"walk"},
            {"provenance/"},
            "",
            true});
}
TEST_F(FaultInjection, Calibrate) {
  SweepAll({{"lumi-calibrate", "@/boards", "--board", "9x6", "--square-mm", "25", "-o", "@/new/camera.yaml"},
            {"boards"},
            {},
            "",
            true});
}
TEST_F(FaultInjection, CalibrateUndistortsAndMeasures) {
  SweepAll({{"lumi-calibrate", "@/boards", "--board", "9x6", "--square-mm", "25", "-o", "@/new/camera.yaml",
             "--undistort", "@/straight", "--tradeoff"},
            {"boards"},
            {},
            "",
            true,
            {"new/camera.tradeoff", "new/report"}});
}
TEST_F(FaultInjection, ReconstructExports) {
  SweepAll({{"lumi-reconstruct", "export", "@/scene", "-o", "@/transforms.json"}, {"scene"}});
  SweepAll({{"lumi-reconstruct", "export", "@/scene", "-o", "@/exported"}, {"scene"}});
}
TEST_F(FaultInjection, ProxyBox) { SweepAll({{"lumi-proxy", "box", "@/walk"}, {"walk/images"}}); }
TEST_F(FaultInjection, ProxyDense) {
  SweepAll({{"lumi-proxy", "dense", "@/scene", "--width", "64", "--iterations", "1"},
            {"scene/images"},
            {"stereo/"},
            "",
            true});
}
TEST_F(FaultInjection, ProxyDenseDepthMapsOnly) {
  SweepAll({{"lumi-proxy", "dense", "@/scene", "--width", "64", "--iterations", "1", "--depth-only"},
            {"scene/images"},
            {"stereo/"},
            "",
            true});
}
TEST_F(FaultInjection, ProxyAuto) {
  SweepAll(
      {{"lumi-proxy", "auto", "@/scene", "--candidates", "plane", "delaunay", "--holdout", "2", "--choose-width", "32"},
       {"scene/images"},
       {"lumigraph.json", "provenance/proxy-auto"},
       "",
       true});
}
TEST_F(FaultInjection, ProxyHullTradeoff) {
  SweepAll({{"lumi-proxy", "hull", "@/scene", "--silhouettes", "@/capture/truth/silhouettes", "--cell-px", "16",
             "--tradeoff"},
            {"scene/images", "capture"},
            {},
            "",
            true,
            {"scene/tradeoff/", "scene/provenance/measured-"}});
}
TEST_F(FaultInjection, ProxySimplifyTradeoff) {
  SweepAll({{"lumi-proxy", "simplify", "@/scene", "--from", "sparse", "--tradeoff", "--table-faces", "100", "--holdout",
             "2", "--choose-width", "32"},
            {"scene/images"},
            {},
            "",
            true,
            {"scene/tradeoff/", "scene/provenance/measured-"}});
}
TEST_F(FaultInjection, RenderTradeoff) {
  SweepAll({{"lumi-render", "tradeoff", "@/scene", "-o", "@/measured", "--quick", "--width", "32", "--holdout", "2",
             "--proxy", "sparse", "--views", "1", "--repeats", "1"},
            {"scene/images"},
            {},
            "",
            true,
            {"scene/fronts/", "measured/", "scene/provenance/measured-"}});
}
TEST_F(FaultInjection, RenderMethods) {
  if (FewFaults()) return;
  SweepAll({{"lumi-render", "methods", "@/scene", "-o", "@/methods", "--proxy", "sparse", "--width", "32", "--views",
             "1", "--repeats", "1", "--methods", "ulr", "--methods", "pighin-1998"},
            {"scene"},
            {},
            "",
            true,
            {"methods/"}});
}
TEST_F(FaultInjection, Stabilize) {
  SweepAll(
      {{"lumi-stabilize", "@/walk", "-o", "@/path.json", "--plot", "@/tracks.svg"}, {"walk/images", "walk/sparse"}});
}
TEST_F(FaultInjection, StabilizeScore) {
  SweepAll({{"lumi-stabilize", "score", "@/walk/video.mp4", "@/walk/video.mp4", "--plot", "@/score.svg"}, {"walk"}});
}
TEST_F(FaultInjection, TimePeriodicPeriod) {
  SweepAll({{"lumi-timeperiodic", "period", "@/fixed.mp4", "--plot", "@/period.svg"}, {"fixed.mp4"}});
}
TEST_F(FaultInjection, TimePeriodicPeriodTradeoff) {
  SweepAll({{"lumi-timeperiodic", "period", "@/fixed.mp4", "--tradeoff", "@/front"},
            {"fixed.mp4"},
            {},
            "",
            true,
            {"front/"}});
}
TEST_F(FaultInjection, TimePeriodicSampling) {
  SweepAll({{"lumi-timeperiodic", "sampling", "@/turning", "--plot", "@/sampling.svg"}, {"turning"}});
}
TEST_F(FaultInjection, TimePeriodicMasks) {
  SweepAll(
      {{"lumi-timeperiodic", "calibrate", "@/waved.mp4", "-o", "@/new", "--fixed-video", "@/fixed.mp4", "--masks-only"},
       {"fixed.mp4", "waved.mp4"},
       {"timeperiodic/"},
       "",
       true});
}
TEST_F(FaultInjection, PipelineStabilizes) {
  SweepAll({{"lumi-pipeline", "@/film.mp4", "--stabilize", "smooth", "-o", "@/steady.mp4", "--no-score"},
            {"film.mp4"},
            {"steady-work/"},
            "",
            true,
            // These say how many frames were there already.
            {"steady-work/report", "steady-work/window-000/steady/render.json"}});
}
TEST_F(FaultInjection, PipelineFromAWorkspace) {
  SweepAll({{"lumi-pipeline", "@/workspace", "-o", "@/new", "--proxy", "plane", "--holdout", "0", "--no-video"},
            {"workspace"},
            // The mark says that an import has not ended: where a run ends without unwinding it stays, as after a kill.
            {"lumigraph.json", "provenance/", "IMPORT-UNFINISHED"}});
}
TEST_F(FaultInjection, PipelineFromPhotos) {
  if (FewFaults()) return;
  SweepAll({{"lumi-pipeline", "@/taken/images", "-o", "@/new", "--poses", "@/taken/truth/sparse", "--quality", "low",
             "--proxy", "plane", "--holdout", "2", "--width", "48", "--seconds", "0.1", "--fidelity-db", "0"},
            {"taken"},
            {"lumigraph.json", "provenance/"},
            "",
            true});
}
// Photos that cannot be read are left out of its picture, and said: what it writes counts here.
TEST_F(FaultInjection, ViewerWrites) {
  if (FewFaults()) return;
  if (!FindProgram("Xvfb")) GTEST_SKIP() << "Xvfb is not installed";
  const fs::path display = *folder_ / "display";
  const ChildProgram server(
      {FindProgram("sh")->string(), "-c", "exec Xvfb -displayfd 3 -screen 0 640x480x24 3>" + display.string()});
  std::string number;
  for (int i = 0; i < 300 && number.empty(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    std::ifstream(display) >> number;
  }
  ASSERT_FALSE(number.empty()) << "Xvfb does not start";
  ::setenv("DISPLAY", (":" + number).c_str(), 1);
  ::setenv("XDG_CONFIG_HOME", (Work() / "config").c_str(), 1);
  const FaultCase c{{"lumi-view", "@/scene", "--width", "160", "--height", "120", "--no-ui", "--script",
                     "wait; screenshot @/shot.png; key-add; jump 1; key-add; path-save @/path.json; "
                     "path-save-nerfstudio @/nerfstudio.json"},
                    {"scene/images"}};
  PlantTemporaries(c);
  Sweep(c, FaultKind::kWrite);
}

}  // namespace
}  // namespace lumi
