// Stages as jobs of a cluster: what is submitted, what is followed, and what is done about jobs that do not end well.
// The cluster is three shell scripts in PATH, which do as a test says.
#include "pipeline/executor/slurm.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <mutex>
#include <thread>

#include "scene/files/atomic_file.h"
#include "scene/files/temporary_folder.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "tests/support/fake_slurm.h"

namespace lumi {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

struct Heard final : ProgressSink {
  void Report(const std::string& task, long done, long total, double, double) override {
    const std::lock_guard lock(mutex);
    all += task + " " + std::to_string(done) + "/" + std::to_string(total) + "\n";
  }
  void Finish(const std::string& task, long, double) override {
    const std::lock_guard lock(mutex);
    all += task + " done\n";
  }
  void Message(const std::string& line) override {
    const std::lock_guard lock(mutex);
    all += line + "\n";
  }
  std::mutex mutex;
  std::string all;
};

class Slurm : public testing::Test {
 protected:
  void SetUp() override {
    path_ = std::getenv("PATH");
    ::setenv("PATH", (bin().string() + ":" + path_).c_str(), 1);
    ::setenv("FAKE", folder_.path().c_str(), 1);
    WriteFakeSlurm(bin());
    WriteShellProgram(bin() / "lumi-fake", R"sh(echo "@progress 1 2 counting things" >&2
echo "a remark" >&2
[ "$1" != fail ] || {
  echo "lumi-fake: it does not go: take more" >&2
  echo '{"error":{"code":1,"message":"it does not go","hint":"take more"}}'
  exit 1
}
[ -e "$FAKE/runs" ] && reused=true || reused=false
echo run >>"$FAKE/runs"
printf '{"said":"%s","where":"%s","reused":%s,"run":%s}' "$1" "$PWD" $reused "$(wc -l <"$FAKE/runs")"
)sh");
  }
  void TearDown() override { ::setenv("PATH", path_.c_str(), 1); }

  fs::path bin() const { return folder_ / "bin"; }
  fs::path jobs() const { return folder_ / "jobs"; }
  void Do(int job, const std::string& what) const {
    WriteTextAtomically(folder_ / ("do-" + std::to_string(job)), what);
  }
  SlurmOptions Options() const {
    SlurmOptions o;
    o.folder = jobs();
    o.poll_seconds = 0.05;
    o.look_seconds = 0.1;
    o.late_seconds = 0.3;
    return o;
  }
  static ExecutedStage Stage(const std::string& argument, const std::string& wanted = {}) {
    return {"proxy", {"lumi-fake", {argument}, "stage 1/2 proxy: ", "proxy: "}, wanted};
  }
  static ExecutedStage Named(const std::string& name) { return {name, {"lumi-fake", {name}, name + " ", name + ": "}}; }
  struct Said {
    std::string said, where;
    int run = 0;
    friend void ListKeys(JsonKeys& j, Said& s) { j("said", s.said, "where", s.where, "run", s.run); }
  };
  // A run whose first job waits in the queue, killed there.
  void LeaveWaiting(const ExecutedStage& stage) const {
    Do(1, "wait");
    const pid_t run = ::fork();
    if (run == 0) {
      Heard heard;
      MakeSlurmExecutor(Options())->Run(stage, heard);
      ::_exit(0);
    }
    const auto has_id = [&] {
      std::error_code error;
      for (const auto& entry : fs::directory_iterator(jobs(), error))
        if (fs::exists(entry.path() / "id")) return true;
      return false;
    };
    while (!has_id()) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ::kill(run, SIGKILL);
    ::waitpid(run, nullptr, 0);
  }
  int Lines(const char* file) const {
    std::error_code error;
    if (!fs::exists(folder_ / file, error)) return 0;
    const std::string text = ReadText(folder_ / file);
    return static_cast<int>(std::ranges::count(text, '\n'));
  }
  TemporaryFolder folder_;
  std::string path_;
  Heard heard_;
};

TEST_F(Slurm, AJobsAnswerIsTheProgramsAndItsFilesGo) {
  SlurmOptions options = Options();
  options.partition = "fast";
  options.options = {"--time=60"};
  options.cpus = 3;
  const std::string odd = "it's $HOME and spaces; `x` *";
  const SiblingAnswer answer = MakeSlurmExecutor(options)->Run(Stage(odd), heard_);
  EXPECT_EQ(answer.summary.As<Said>().said, odd);
  EXPECT_EQ(answer.summary.As<Said>().where, fs::current_path().string()) << "relative paths mean the same there";
  EXPECT_GT(answer.seconds, 0);
  EXPECT_FALSE(fs::exists(jobs()));
  for (const char* word : {"--partition=fast", "--time=60", "--cpus-per-task=3", "--requeue", "--job-name=lumi-proxy"})
    EXPECT_THAT(ReadText(folder_ / "submitted"), HasSubstr(word));
  EXPECT_THAT(heard_.all, HasSubstr("proxy: job 1\n"));
  EXPECT_THAT(heard_.all, HasSubstr("proxy: a remark\n"));
  EXPECT_THAT(heard_.all, HasSubstr("stage 1/2 proxy: counting things 1/2"));
  EXPECT_THAT(heard_.all, Not(HasSubstr("@progress")));
}

TEST_F(Slurm, StagesAtTheSameTimeAreOneArrayWithAnAnswerEach) {
  Do(1, "lost 1");  // the array's second task
  const std::vector<SiblingAnswer> answers =
      MakeSlurmExecutor(Options())->RunAll({Named("a"), Named("b"), Named("c")}, "all three", heard_);
  ASSERT_EQ(answers.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(answers[i].summary.As<Said>().said, std::string(1, static_cast<char>('a' + i)));
  EXPECT_EQ(Lines("submitted"), 2) << "the array, and the task that was lost with its node, as a job of its own";
  EXPECT_THAT(ReadText(folder_ / "submitted"), HasSubstr("--array=0-2"));
  EXPECT_THAT(heard_.all, HasSubstr("job array 1, 3 tasks"));
  EXPECT_THAT(heard_.all, HasSubstr("b: job 1_1 was lost with its node"));
  EXPECT_THAT(heard_.all, HasSubstr("all three done"));
  EXPECT_FALSE(fs::exists(jobs()));
}

TEST_F(Slurm, OfAnArraysTasksThatFailTheFirstOnesFailureIsThrownWhenAllHaveEnded) {
  try {
    MakeSlurmExecutor(Options())->RunAll({Named("a"), Named("fail"), Named("c")}, "all three", heard_);
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "it does not go");
  }
  EXPECT_EQ(Lines("runs"), 2);
  EXPECT_TRUE(fs::exists(jobs())) << "the failed one's lines stay";
  // The next run of all submits that one again, and tidies up.
  WriteShellProgram(bin() / "lumi-fake", "echo '{\"said\":\"better\"}'\n");
  MakeSlurmExecutor(Options())->RunAll({Named("a"), Named("fail"), Named("c")}, "all three", heard_);
  EXPECT_FALSE(fs::exists(jobs()));
}

TEST_F(Slurm, CtrlCLeavesAnArraysTasksInTheQueueAndTheFolderTheyStartIn) {
  Do(1, "wait");
  const pid_t run = ::fork();
  if (run == 0) {
    InstallInterruptHandler();
    Heard heard;
    try {
      MakeSlurmExecutor(Options())->RunAll({Named("a"), Named("b")}, "both", heard);
    } catch (const Interrupted&) {
      ::_exit(heard.all.find("a: job 1_0 goes on") != std::string::npos ? 130 : 1);
    }
    ::_exit(0);
  }
  while (Lines("submitted") == 0 || Lines("count") == 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  ::kill(run, SIGINT);
  int status = 0;
  ::waitpid(run, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 130);
  bool array = false;
  for (const auto& entry : fs::directory_iterator(jobs()))
    array |= entry.path().filename().string().starts_with("array-");
  EXPECT_TRUE(array);
  WriteTextAtomically(folder_ / "go", "");
}

TEST_F(Slurm, AnArraysTaskThatTheControllerForgotIsSubmittedAgain) {
  Do(1, "forgotten 1");
  MakeSlurmExecutor(Options())->RunAll({Named("a"), Named("b")}, "both", heard_);
  EXPECT_THAT(heard_.all, HasSubstr("b: job 1_1 was lost with its node"));
  EXPECT_EQ(Lines("submitted"), 2);
}

TEST_F(Slurm, ASecondStartFollowsTheTasksOfAnArrayWhoseSubmitterWasKilled) {
  Do(1, "wait");
  const std::vector<ExecutedStage> stages{Named("a"), Named("b")};
  const pid_t run = ::fork();
  if (run == 0) {
    Heard heard;
    MakeSlurmExecutor(Options())->RunAll(stages, "both", heard);
    ::_exit(0);
  }
  const auto ids = [&] {
    int n = 0;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(jobs(), error)) n += fs::exists(entry.path() / "id");
    return n;
  };
  while (ids() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  ::kill(run, SIGKILL);
  ::waitpid(run, nullptr, 0);
  // One was killed before it wrote the id: squeue knows the task by the array's name.
  for (const auto& entry : fs::directory_iterator(jobs()))
    if (entry.path().filename().string().starts_with("b-")) fs::remove(entry.path() / "id");
  WriteTextAtomically(folder_ / "queued", "1_0\n1_1\n");
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    WriteTextAtomically(folder_ / "go", "");
  });
  const std::vector<SiblingAnswer> answers = MakeSlurmExecutor(Options())->RunAll(stages, "both", heard_);
  later.join();
  EXPECT_EQ(answers[1].summary.As<Said>().said, "b");
  EXPECT_THAT(heard_.all, HasSubstr("a: job 1_0 was submitted by an earlier run"));
  EXPECT_THAT(heard_.all, HasSubstr("b: job 1_1 was submitted by an earlier run"));
  EXPECT_FALSE(fs::exists(jobs()));
}

TEST_F(Slurm, WholeNodesAreAskedForWhereNobodySaysHowManyCores) {
  MakeSlurmExecutor(Options())->Run(Stage("x"), heard_);
  EXPECT_THAT(ReadText(folder_ / "submitted"), HasSubstr("--exclusive"));
}

TEST_F(Slurm, AProgramsFailureIsThrownAsItsOwnAndItsLinesStay) {
  try {
    MakeSlurmExecutor(Options())->Run(Stage("fail"), heard_);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::kDataRefused);
    EXPECT_STREQ(e.what(), "it does not go");
    EXPECT_EQ(e.hint(), "take more");
  }
  EXPECT_THAT(heard_.all, HasSubstr("job 1 failed on "));
  EXPECT_THAT(heard_.all, HasSubstr("lines.txt"));
  EXPECT_TRUE(fs::exists(jobs()));
  // The next run tries again.
  WriteShellProgram(bin() / "lumi-fake", "echo '{\"said\":\"better\"}'\n");
  EXPECT_EQ(MakeSlurmExecutor(Options())->Run(Stage("fail"), heard_).summary.As<Said>().said, "better");
  EXPECT_EQ(Lines("submitted"), 2);
}

TEST_F(Slurm, AJobThatIsLostWithItsNodeIsSubmittedAgain) {
  Do(1, "lost");
  Do(2, "lost");
  EXPECT_EQ(MakeSlurmExecutor(Options())->Run(Stage("x"), heard_).summary.As<Said>().said, "x");
  EXPECT_EQ(Lines("submitted"), 3);
  EXPECT_THAT(heard_.all, HasSubstr("job 2 was lost with its node"));
  for (int job = 4; job < 9; ++job) Do(job, "lost");
  EXPECT_THROW(MakeSlurmExecutor(Options())->Run(Stage("y"), heard_), MachineError);
  EXPECT_EQ(Lines("submitted"), 7) << "not for ever";
}

TEST_F(Slurm, WhatSomebodyEndedIsNotSubmittedAgain) {
  const std::pair<const char*, const char*> cases[] = {
      {"cancelled", "was cancelled"}, {"timeout", "time limit"}, {"mute", "without an answer"}};
  int job = 0;
  for (const auto& [what, said] : cases) {
    Do(++job, what);
    try {
      MakeSlurmExecutor(Options())->Run(Stage(what), heard_);
      FAIL() << what;
    } catch (const MachineError& e) {
      EXPECT_THAT(e.what(), HasSubstr(said));
      EXPECT_FALSE(e.hint().empty());
    }
    EXPECT_EQ(Lines("submitted"), job);
    // The same command again is another try.
    EXPECT_EQ(MakeSlurmExecutor(Options())->Run(Stage(what), heard_).summary.As<Said>().said, what);
    EXPECT_EQ(Lines("submitted"), ++job);
  }
  Do(++job, "refuse");
  try {
    MakeSlurmExecutor(Options())->Run(Stage("x"), heard_);
    FAIL();
  } catch (const MachineError& e) {
    EXPECT_THAT(e.what(), HasSubstr("invalid partition"));
  }
}

TEST_F(Slurm, ASecondStartFollowsTheJobOfOneThatWasKilled) {
  LeaveWaiting(Stage("x"));
  const auto pause = [](int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); };
  std::thread later([&] {
    pause(300);
    WriteTextAtomically(folder_ / "controller-down", "");  // restarted: jobs go on
    pause(300);
    fs::remove(folder_ / "controller-down");
    WriteTextAtomically(folder_ / "go", "");
  });
  const Said said = MakeSlurmExecutor(Options())->Run(Stage("x"), heard_).summary.As<Said>();
  later.join();
  EXPECT_EQ(said.said, "x");
  // Its inputs may have changed meanwhile: the program is asked once more, and says that there was nothing to do.
  EXPECT_EQ(Lines("submitted"), 2);
  EXPECT_EQ(Lines("runs"), 2);
  EXPECT_EQ(said.run, 1) << "the answer of the run that did the work";
  EXPECT_THAT(heard_.all, HasSubstr("job 1 was submitted by an earlier run, and is followed"));
  EXPECT_THAT(heard_.all, HasSubstr("waits (Resources)"));
}

TEST_F(Slurm, AJobOfOtherOptionsThatIsNotDoneIsInTheWay) {
  LeaveWaiting(Stage("other"));
  try {
    MakeSlurmExecutor(Options())->Run(Stage("x"), heard_);
    FAIL();
  } catch (const MachineError& e) {
    EXPECT_THAT(e.what(), HasSubstr("job 1 of an earlier run"));
    EXPECT_THAT(e.hint(), HasSubstr("scancel 1"));
  }
  WriteTextAtomically(folder_ / "state-1", "CANCELLED\n");
  EXPECT_EQ(MakeSlurmExecutor(Options())->Run(Stage("x"), heard_).summary.As<Said>().said, "x");
  WriteTextAtomically(folder_ / "go", "");
}

TEST_F(Slurm, FoldersOfAnyName) {
  SlurmOptions options = Options();
  options.folder = folder_ / "50%j of it's $HOME";
  EXPECT_EQ(MakeSlurmExecutor(options)->Run(Stage("x"), heard_).summary.As<Said>().said, "x");
  // Of Slurm's own options no name may be a pattern: its output is named from there.
  EXPECT_THAT(ReadText(folder_ / "submitted"), HasSubstr("--output=slurm.txt"));
}

// A job that ended while nobody followed it: of a program that records nothing itself its answer counts where it read
// the same; one that does find out by itself is asked again.
TEST_F(Slurm, WhatEndedMeanwhileCountsWhereItReadTheSame) {
  const auto leave = [&](const std::string& wanted) {
    Do(Lines("submitted") + 1, "lost");
    SlurmOptions o = Options();
    try {
      for (int job = Lines("submitted") + 1; job < Lines("submitted") + 5; ++job) Do(job, "lost");
      MakeSlurmExecutor(o)->Run(Stage("x", wanted), heard_);
    } catch (const MachineError&) {
    }
    for (const auto& entry : fs::directory_iterator(jobs())) {
      WriteTextAtomically(entry.path() / "answer.json", R"({"said":"meanwhile"})");
      WriteTextAtomically(entry.path() / "ended", "0\n");
    }
  };
  leave("photos 1");
  EXPECT_EQ(MakeSlurmExecutor(Options())->Run(Stage("x", "photos 1"), heard_).summary.As<Said>().said, "meanwhile");
  leave("photos 1");
  EXPECT_EQ(MakeSlurmExecutor(Options())->Run(Stage("x", "photos 2"), heard_).summary.As<Said>().said, "x");
  fs::remove_all(jobs());
  leave("");
  EXPECT_EQ(MakeSlurmExecutor(Options())->Run(Stage("x"), heard_).summary.As<Said>().said, "x");
}

TEST_F(Slurm, WithoutSlurmThereIsOneClearLine) {
  fs::remove(bin() / "sbatch");
  ::setenv("PATH", bin().c_str(), 1);
  try {
    MakeSlurmExecutor(Options());
    FAIL();
  } catch (const MachineError& e) {
    EXPECT_STREQ(e.what(), "sbatch is not in PATH: --executor slurm needs Slurm's commands");
    EXPECT_THAT(e.hint(), HasSubstr("slurm-client"));
  }
}

TEST(SlurmText, IdsAndStatesAreReadAsSlurmPrintsThem) {
  EXPECT_EQ(JobIdFrom("12345\n"), "12345");
  EXPECT_EQ(JobIdFrom("12345;cluster\n"), "12345");
  for (const char* none : {"", "\n", "sbatch: error", "12a"}) EXPECT_EQ(JobIdFrom(none), "") << none;
  const JobState s = JobStateFrom("JobId=7 JobName=x Priority=1 JobState=NODE_FAIL Reason=NodeDown Restarts=2\n");
  EXPECT_EQ(JobStateFrom("").state, "");
  EXPECT_EQ(s.state, "NODE_FAIL");
  EXPECT_EQ(s.restarts, 2);
  EXPECT_EQ(s.reason, "NodeDown");
}

}  // namespace
}  // namespace lumi
