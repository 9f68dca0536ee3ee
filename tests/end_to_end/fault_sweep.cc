#include "tests/end_to_end/fault_sweep.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "scene/files/atomic_file.h"
#include "scene/files/json_keys.h"
#include "scene/program/subprocess.h"
#include "tests/support/bad_input.h"
#include "tests/support/same_outputs.h"

namespace lumi {
namespace fs = std::filesystem;

namespace {

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

}  // namespace

std::unique_ptr<TemporaryFolder> FaultInjection::folder_;
std::set<std::string> FaultInjection::stacks_;
std::vector<std::string> FaultInjection::new_stacks_;
int FaultInjection::injected_ = 0;
int FaultInjection::harmless_ = 0;

void FaultInjection::SetUpTestSuite() {
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
  WriteTextAtomically(Template() / "list.txt", "workspace\n");
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
  Make({"lumi-simulate", "--example", "helicopter", "--video", "--views", "60", "--width", "48", "--fixed-frames", "60",
        "-o", lamp.string()});
  fs::copy(lamp / "fixed.mp4", Template() / "fixed.mp4");
  fs::copy(lamp / "video.mp4", Template() / "waved.mp4");
  fs::copy(lamp, Template() / "turning", fs::copy_options::recursive);
  const SubprocessResult film = RunSubprocess(
      {"ffmpeg", "-v", "error", "-y", "-f", "lavfi", "-i", "color=c=gray:s=160x120:r=30:d=0.4", "-f", "lavfi", "-i",
       "sine=frequency=440:duration=0.4", "-c:v", "mpeg4", (Template() / "film.mp4").string()});
  ASSERT_EQ(film.exit_code, 0) << testing::PrintToString(film.tail);
}

void FaultInjection::TearDownTestSuite() {
  folder_.reset();
  std::cout << "faults injected in all: " << injected_ << " (" << harmless_ << " of them did not matter)\n";
}

void FaultInjection::Make(const std::vector<std::string>& argv) {
  const ProgramResult made = RunProgram(argv);
  ASSERT_EQ(made.exit_code, 0) << made.err;
}

void FaultInjection::Reset(const FaultCase& c) {
  fs::remove_all(Work());
  fs::create_directories(Work());
  std::set<fs::path> given;
  for (const std::string& a : c.argv)
    if (a.starts_with("@/")) given.insert(*fs::path(a.substr(2)).begin());
  for (const std::string& input : c.inputs) given.insert(*fs::path(input).begin());
  for (const fs::path& name : given)
    if (fs::exists(Template() / name)) fs::copy(Template() / name, Work() / name, fs::copy_options::recursive);
}

std::vector<std::string> FaultInjection::Arguments(const FaultCase& c) {
  std::vector<std::string> argv = c.argv;
  for (std::string& a : argv)
    for (auto at = a.find("@/"); at != std::string::npos; at = a.find("@/")) a.replace(at, 1, Work().string());
  // One thread: the calls then come in one order.
  for (const char* more : {"--threads", "1", "--quiet"}) argv.emplace_back(more);
  return argv;
}

std::map<std::string, std::string> FaultInjection::Files(const FaultCase& c) {
  auto files = ComparableFiles(Work());
  for (auto& [name, hash] : files)
    if (std::ranges::any_of(c.measured, [&file = name](const std::string& m) { return file.starts_with(m); })) {
      const std::string text = ReadText(Work() / name);
      hash = text.empty() || (name.ends_with(".json") && !JsonKeys::Parse(text)) ? "cut off" : "measured";
    }
  return files;
}

std::vector<long> FaultInjection::NewStacks(const std::string& program, const FaultRun& counted) {
  std::vector<long> points;
  for (std::size_t i = 0; i < counted.points.size(); ++i)
    if (IsNew(program + " " + counted.calls[i])) points.push_back(counted.points[i]);
  return points;
}

std::vector<long> FaultInjection::NewStacksOfLoading(const FaultRun& counted, const FaultRun& served) {
  const std::set<std::string> known(served.calls.begin(), served.calls.end());
  std::vector<long> points;
  for (std::size_t i = 0; i < counted.points.size(); ++i)
    if (!known.contains(counted.calls[i]) && IsNew("loading " + counted.calls[i])) points.push_back(counted.points[i]);
  return points;
}

bool FaultInjection::IsNew(const std::string& stack) {
  if (!stacks_.insert(stack).second) return false;
  new_stacks_.push_back(stack);
  return true;
}

void FaultInjection::KeepSwept() {
  if (PartOfStacks() && !SweptFile().empty() && !HasFailure()) {
    std::ofstream swept(SweptFile(), std::ios::app);
    for (const std::string& stack : new_stacks_) swept << stack << "\n";
  }
  new_stacks_.clear();
}

void FaultInjection::PlantTemporaries(const FaultCase& c) {
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

void FaultInjection::Sweep(const FaultCase& c, FaultKind kind) {
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
            << counted.points.size() << " with those of other cases), " << harmless << " of them harmless, " << crashed
            << " ended by a crash of a library" << std::endl;
  KeepSwept();
  injected_ += failed;
  harmless_ += harmless;
}

bool FaultInjection::CrashIsOurs(const std::string& stack) {
  std::istringstream lines(stack);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with('/') && line.find("fault_injection") == std::string::npos &&
        line.find("/libc.so") == std::string::npos)
      return line.find("/bin/lumi-") != std::string::npos || line.find("liblumi_") != std::string::npos;
  return false;
}

void FaultInjection::ExpectOneLine(const ProgramResult& result, const std::string& program, FaultKind kind) {
  EXPECT_TRUE(result.exit_code == 4 || (result.exit_code == 3 && kind == FaultKind::kRead)) << result.exit_code;
  const std::vector<std::string> lines = result.ErrorLines();
  ASSERT_FALSE(lines.empty());
  EXPECT_THAT(lines.back(), testing::StartsWith(program + ": "));
  EXPECT_EQ(std::ranges::count_if(lines, [&](const auto& line) { return line.starts_with(program + ": "); }), 1);
  if (kind == FaultKind::kMemory) {
    EXPECT_THAT(lines.back(), testing::HasSubstr("memory"));
  }
}

void FaultInjection::ExpectWhole(const FaultCase& c, const std::map<std::string, std::string>& before,
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

void FaultInjection::SweepAll(const FaultCase& c) {
  if (PartOfStacks()) return Sweep(c, FaultKind::kMemory);
  PlantTemporaries(c);
  for (const FaultKind kind : {FaultKind::kWrite, FaultKind::kRead, FaultKind::kMemory})
    if (!HasFailure() && !(c.is_slow && FewFaults() && kind != FaultKind::kWrite)) Sweep(c, kind);
}

}  // namespace lumi
