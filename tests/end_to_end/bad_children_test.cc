// COLMAP, ffmpeg or ffprobe that hangs, dies or prints nonsense: a program of its name stands before it in PATH.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>

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
  static constexpr int kPhotos = 8;  // enough for COLMAP to place them

  static void SetUpTestSuite() { capture_ = std::make_unique<SimulatedCapture>("desk", kPhotos, 320); }
  static void TearDownTestSuite() { capture_.reset(); }

  // The environment in which NAME does `what`; given a command, only in that one.
  std::map<std::string, std::string> With(const std::string& name, const std::string& what, bool also_help = false,
                                          const std::string& in_command = "*") {
    const fs::path fake = folder_ / "bin" / name;
    const std::string real = "exec '" + FindProgram(name).value().string() + "' \"$@\"\n";
    std::string script = "#!/bin/sh\n";
    if (!also_help) script += "case \"$*\" in help|*\" -h\") " + real + ";; esac\n";
    script += "case \"$1\" in " + in_command + ") " + what + ";; *) " + real + ";; esac\n";
    WriteTextAtomically(fake, script);
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

// Features are there, and COLMAP fails later.
TEST_F(BadChildren, ColmapThatIsKilledAtALaterStep) {
  const std::map<std::string, const char*> steps = {
      {"feature_extractor", "colmap"}, {"exhaustive_matcher", "colmap"}, {"mapper", "own"}, {"bundle_adjuster", "own"}};
  for (const auto& [command, features] : steps) {
    std::vector<std::string> argv = Reconstruct();
    argv.insert(argv.end(), {"--features", features});
    ExpectMachine(argv, With("colmap", kDie, false, command), "COLMAP was ended by signal 9");
    fs::remove_all(Scene());  // the next one begins anew, not where this one stopped
  }
}

TEST_F(BadChildren, ColmapsMapperThatWritesNothingOrHalfOfIt) {
  ExpectMachine(Reconstruct(), With("colmap", kNothing, false, "mapper"), "wrote no model");
  ExpectMachine(Reconstruct(), With("colmap", kNonsense, false, "mapper"), "wrote no model");
  ExpectMachine(Reconstruct(), With("colmap", kCrash, false, "mapper"), "COLMAP was ended by signal 11");
  const std::string cut_off = "'" + FindProgram("colmap").value().string() + "' \"$@\"; find '" +
                              folder_.path().string() + "' -name images.bin -exec truncate -s 100 '{}' ';'";
  for (const char* command : {"mapper", "bundle_adjuster"})
    ExpectMachine(Reconstruct(), With("colmap", cut_off, false, command), "COLMAP left a model that cannot be read");
  // What killed it gone, the next run goes on.
  const ProgramResult again = RunProgram(Reconstruct());
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

TEST_F(BadChildren, ColmapsLastAdjustmentMayFail) {
  for (const char* what : {kCrash, kNothing, "exit 1"}) {
    const ProgramResult run = RunProgram(Reconstruct(), With("colmap", what, false, "bundle_adjuster"));
    EXPECT_EQ(run.exit_code, 0) << what << run.err;
    fs::remove_all(Scene());
  }
}

TEST_F(BadChildren, ColmapThatHangsEndsWithUs) {
  ExpectInterruptible(Reconstruct(), With("colmap", kHang), "finding features");
  ExpectInterruptible(Reconstruct(), With("colmap", kHang, false, "mapper"), "placing cameras");
}

// A film with sound, which ffmpeg takes over; ffprobe says when it begins.
class BadFfmpeg : public BadChildren {
 protected:
  static void SetUpTestSuite() {
    BadChildren::SetUpTestSuite();
    const SubprocessResult made = RunSubprocess(
        {"ffmpeg", "-v", "error", "-y", "-f", "lavfi", "-i", "color=c=gray:s=160x120:r=30:d=1", "-f", "lavfi", "-i",
         "sine=frequency=440:duration=1", "-c:v", "mpeg4", (*capture_ / "film.mp4").string()});
    ASSERT_EQ(made.exit_code, 0) << testing::PrintToString(made.tail);
  }
  std::vector<std::string> Stabilize() const {
    return {"lumi-pipeline",
            (*capture_ / "film.mp4").string(),
            "--stabilize",
            "smooth",
            "--split-screen",
            "--no-score",
            "-o",
            Film().string()};
  }
  fs::path Film() const { return folder_ / "steady.mp4"; }
};

TEST_F(BadFfmpeg, ThatIsKilledOrWritesNothingLeavesNoSilentFilm) {
  for (const auto& [what, says] : std::map<std::string, std::string>{
           {kDie, "ffmpeg was ended by signal 9"},
           {kCrash, "ffmpeg was ended by signal 11"},
           {kNonsense, "wrote nothing"},
           {kNothing, "wrote nothing"},
           {"echo 'steady.mp4: No space left on device' >&2; exit 1", "No space left on device"},
           {"for f; do :; done; echo half >\"${f#file:}\"; echo 'Error writing trailer: No space left on device' >&2",
            "No space left on device"}}) {
    ExpectMachine(Stabilize(), With("ffmpeg", what), says);
    EXPECT_FALSE(fs::exists(Film())) << what;
  }
  // The next run goes on, and the film has its sound.
  const ProgramResult again = RunProgram(Stabilize());
  EXPECT_EQ(again.exit_code, 0) << again.err;
  for (const char* film : {"steady.mp4", "steady-split.mp4"}) {
    SubprocessOptions options;
    options.separate_stdout = true;
    EXPECT_EQ(RunSubprocess({"ffprobe", "-v", "error", "-select_streams", "a", "-show_entries", "stream=codec_type",
                             "-of", "csv=p=0", (folder_ / film).string()},
                            options)
                  .out,
              "audio\n")
        << film;
  }
}

TEST_F(BadFfmpeg, ThatRefusesTheSoundLeavesASilentFilmAndSaysSo) {
  // From version 6 on with the low byte of its error ("invalid data"); of a film that is cut off it says what it would
  // of a failing disk.
  for (const char* what : {"exit 183", "echo 'film.mp4: Input/output error' >&2; exit 1"}) {
    const ProgramResult run = RunProgram(Stabilize(), With("ffmpeg", what));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    for (const char* film : {"steady.mp4", "steady-split.mp4"}) {
      EXPECT_TRUE(fs::exists(folder_ / film));
      EXPECT_THAT(run.err, HasSubstr("the sound could not be taken over into " + (folder_ / film).string()));
    }
  }
}

TEST_F(BadFfmpeg, FfprobeThatIsKilledIsSaidAndWhatItSaysInNonsenseIsNoBeginning) {
  ExpectMachine(Stabilize(), With("ffprobe", kDie), "ffprobe was ended by signal 9");
  const ProgramResult run = RunProgram(Stabilize(), With("ffprobe", kNonsense));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(fs::exists(Film()));
}

TEST_F(BadFfmpeg, ThatHangsEndsWithUs) {
  for (const char* name : {"ffmpeg", "ffprobe"}) {
    const fs::path hangs = folder_ / "hangs";
    fs::remove(hangs);
    ChildProgram run(Stabilize(), With(name, "touch '" + hangs.string() + "'; " + kHang));
    for (int i = 0; i < 1200 && !fs::exists(hangs); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    ASSERT_TRUE(fs::exists(hangs)) << name << " was not started: " << run.Wait().err;
    run.Signal(SIGINT);
    const ProgramResult result = run.Wait(60);
    EXPECT_EQ(result.exit_code, 130) << result.err;
    EXPECT_TRUE(WaitForNoProcessNaming(folder_.path()));
    EXPECT_EQ(TemporariesIn(folder_.path()), "");
    EXPECT_FALSE(fs::exists(Film()));
  }
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
