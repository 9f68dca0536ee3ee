// COLMAP that hangs, dies or prints nonsense: a program of its name stands before it in PATH.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <memory>

#include "scene/files/atomic_file.h"
#include "scene/program/subprocess.h"
#include "tests/support/bad_input.h"
#include "tests/support/same_outputs.h"
#include "tests/support/simulated_capture.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

// What the fake does instead; colmap's help is the real one's, so that the options are known.
constexpr const char* kHang = "trap '' TERM; while :; do sleep 1; done";
constexpr const char* kDie = "kill -9 $$";
constexpr const char* kCrash = "kill -SEGV $$";
constexpr const char* kNonsense = "head -c 300000 /dev/urandom; head -c 300000 /dev/urandom >&2; exit 0";
constexpr const char* kNothing = "exit 0";

class BadChildren : public testing::Test {
 protected:
  static void SetUpTestSuite() { capture_ = std::make_unique<SimulatedCapture>("desk", 4, 96); }
  static void TearDownTestSuite() { capture_.reset(); }

  // The environment in which NAME does `what`.
  std::map<std::string, std::string> With(const std::string& name, const std::string& what, bool also_help = false) {
    const fs::path fake = folder_ / "bin" / name;
    std::string script = "#!/bin/sh\n";
    if (!also_help)
      script += "case \"$*\" in help|*\" -h\") exec '" + FindProgram(name).value().string() + "' \"$@\";; esac\n";
    WriteTextAtomically(fake, script + what + "\n");
    fs::permissions(fake, fs::perms::owner_all);
    return {{"PATH", fake.parent_path().string() + ":" + std::getenv("PATH")}, {"LUMI_PROGRESS_PIPE", "1"}};
  }
  std::vector<std::string> Reconstruct() const {
    return {"lumi-reconstruct", capture_->photos().string(), "-o", Scene().string(), "--quality", "low"};
  }
  fs::path Scene() const { return folder_ / "scene"; }

  void ExpectMachine(const std::vector<std::string>& argv, const std::map<std::string, std::string>& environment,
                     const std::string& says) {
    const std::string before = Contents(capture_->path());
    const ProgramResult result = RunProgram(argv, environment);
    EXPECT_EQ(result.exit_code, 4) << result.err;
    const auto lines = result.ErrorLines();
    ASSERT_FALSE(lines.empty());
    EXPECT_THAT(lines.back(), testing::StartsWith(argv[0] + ": "));
    EXPECT_THAT(lines.back(), HasSubstr(says));
    EXPECT_EQ(Contents(capture_->path()), before);
    ExpectNothingHalfWritten();
  }
  void ExpectNothingHalfWritten() {
    EXPECT_FALSE(fs::exists(Scene() / "lumigraph.json"));
    EXPECT_EQ(TemporariesIn(folder_.path()), "");
  }
  // Ctrl-C ends the program and the child, which does not listen.
  void ExpectInterruptible(const std::vector<std::string>& argv, const std::map<std::string, std::string>& environment,
                           const std::string& once_it_says) {
    ChildProgram run(argv, environment);
    ASSERT_TRUE(run.WaitForErrorText(once_it_says)) << run.Wait().err;
    run.Signal(SIGINT);
    const ProgramResult result = run.Wait(60);
    EXPECT_EQ(result.exit_code, 130) << result.err;
    EXPECT_TRUE(WaitForNoProcessNaming(folder_.path()));
    ExpectNothingHalfWritten();
  }

  static std::unique_ptr<SimulatedCapture> capture_;
  TemporaryFolder folder_;
};
std::unique_ptr<SimulatedCapture> BadChildren::capture_;

TEST_F(BadChildren, ColmapThatIsKilledOrCrashesIsNoVerdictOnThePhotos) {
  ExpectMachine(Reconstruct(), With("colmap", kDie), "COLMAP was ended by signal 9");
  ExpectMachine(Reconstruct(), With("colmap", kCrash), "COLMAP was ended by signal 11");
  ExpectMachine(Reconstruct(), With("colmap", "echo \"what():  std::bad_alloc\" >&2; kill -ABRT $$"), "out of memory");
}

TEST_F(BadChildren, ColmapThatPrintsNonsenseAndDoesNothing) {
  ExpectMachine(Reconstruct(), With("colmap", kNonsense), "COLMAP made no database");
  ExpectMachine(Reconstruct(), With("colmap", kNothing), "COLMAP made no database");
  ExpectMachine(Reconstruct(), With("colmap", kNonsense, true), "no options");
  ExpectMachine(Reconstruct(), With("colmap", kNothing, true), "no options");
}

TEST_F(BadChildren, ColmapThatHangsEndsWithUs) {
  ExpectInterruptible(Reconstruct(), With("colmap", kHang), "finding features");
}

TEST_F(BadChildren, AProcessThatAChildLeftBehindIsNotWaitedFor) {
  SubprocessOptions options;
  options.separate_stdout = true;
  const SubprocessResult result = RunSubprocess({"/bin/sh", "-c", "sleep 1000 & echo done; exit 3"}, options);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.out, "done\n");
  EXPECT_LT(result.seconds, 100);
}

}  // namespace
}  // namespace lumi
