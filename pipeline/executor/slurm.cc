#include "pipeline/executor/slurm.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <exception>
#include <fstream>
#include <functional>
#include <mutex>
#include <optional>
#include <sstream>
#include <string_view>
#include <thread>
#include <utility>

#include "pipeline/named_remarks.h"
#include "scene/files/atomic_file.h"
#include "scene/files/provenance.h"
#include "scene/program/error.h"
#include "scene/program/interrupt.h"
#include "scene/program/shell_word.h"
#include "scene/program/stopwatch.h"
#include "scene/program/subprocess.h"

namespace lumi {
namespace fs = std::filesystem;
namespace {

constexpr int kMostSubmissions = 4;         // of one stage whose nodes are lost
constexpr double kShare = 0.15;             // of late_seconds, for jobs that were ended
constexpr double kFirstPauseSeconds = 0.1;  // short jobs are seen soon ...
constexpr double kShortJobSeconds = 30, kShortJobPause = 0.2;
constexpr const char* kArray = "array-";    // of an array's folder and name
constexpr std::size_t kMostFollowed = 64;   // tasks of an array at once; others wait until one has ended
constexpr double kControllerSeconds = 600;  // without an answer until the job is given up for lost

struct Printed {
  int code = 0;
  std::string out, said;
};

Printed Command(const std::vector<std::string>& argv) {
  SubprocessOptions options;
  options.separate_stdout = true;
  const SubprocessResult r = RunSubprocess(argv, options);
  return {r.exit_code, r.out, r.tail.empty() ? std::string() : r.tail.back()};
}

std::optional<std::string> TextOf(const fs::path& file) {
  std::error_code error;
  if (!fs::exists(file, error)) return std::nullopt;
  try {
    return ReadText(file);
  } catch (const InputError&) {
    return std::nullopt;  // gone meanwhile
  }
}

std::string FirstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

// The lines that a job has added to a file since the last look; a job that was begun anew writes it anew.
class NewLines {
 public:
  explicit NewLines(fs::path file) : file_(std::move(file)) {}
  // all: also a last one without its end.
  void Read(const std::function<void(const std::string&)>& line, bool all) {
    std::ifstream in(file_, std::ios::binary);
    if (!in) return;
    in.seekg(0, std::ios::end);
    const auto size = static_cast<std::streamoff>(in.tellg());
    if (size < at_) {
      at_ = 0;
      rest_.clear();
    }
    in.seekg(at_);
    std::string added(static_cast<std::size_t>(size - at_), '\0');
    in.read(added.data(), static_cast<std::streamsize>(added.size()));
    added.resize(static_cast<std::size_t>(in.gcount()));
    at_ += static_cast<std::streamoff>(added.size());
    rest_ += added;
    std::size_t begin = 0;
    for (std::size_t end; (end = rest_.find('\n', begin)) != std::string::npos; begin = end + 1)
      line(rest_.substr(begin, end - begin));
    rest_.erase(0, begin);
    if (all && !rest_.empty()) line(std::exchange(rest_, {}));
  }

 private:
  fs::path file_;
  std::streamoff at_ = 0;
  std::string rest_;
};

struct JobFiles {
  explicit JobFiles(fs::path at) : folder(std::move(at)) {}
  fs::path folder, script = folder / "job.sh", id = folder / "id", answer = folder / "answer.json",
                   lines = folder / "lines.txt", node = folder / "node", seconds = folder / "seconds",
                   ended = folder / "ended", array = folder / "array";  // "NAME INDEX" of a job array's task
};

// `ended` is renamed into its place when all else is written; a job that was requeued begins with clean files.
std::string ScriptOf(const std::vector<std::string>& command, const JobFiles& files) {
  std::string text = "#!/bin/sh\n";
  text += "cd " + ShellWord(files.folder.string()) + " || exit 1\n";
  text += "rm -f ended ended.part\necho \"$SLURM_JOB_ID\" >id\nhostname >node\nstart=$(date +%s.%N)\n";
  text += "cd " + ShellWord(fs::current_path().string()) + " || exit 1\n";
  text += "LUMI_PROGRESS_PIPE=1";
  for (const std::string& part : command) text += " " + ShellWord(part);
  text += fmt::format(" >{} 2>{} </dev/null\n", ShellWord(files.answer.string()), ShellWord(files.lines.string()));
  text += "code=$?\ncd " + ShellWord(files.folder.string()) + "\n";
  text += "echo \"$start $(date +%s.%N)\" >seconds\necho $code >ended.part\nmv ended.part ended\n";
  return text;
}

class SlurmExecutor final : public Executor {
 public:
  explicit SlurmExecutor(SlurmOptions options) : options_(std::move(options)) {
    for (const char* program : {"sbatch", "squeue", "scontrol"})
      if (!FindProgram(program))
        throw MachineError(fmt::format("{} is not in PATH: --executor slurm needs Slurm's commands", program),
                           "install slurm-client, or run here: --executor local");
    if (const Printed p = Command({"squeue", "-h", "-t", "RUNNING"}); p.code != 0)
      throw MachineError(fmt::format("no Slurm cluster answers: {}", p.said),
                         "sinfo says more; --executor local runs here");
    options_.folder = fs::absolute(options_.folder);
  }

  SiblingAnswer Run(const ExecutedStage& stage, ProgressSink& progress) override {
    CheckInterrupted();
    Job job = JobFor(stage, progress);
    const bool earlier = job.earlier;
    const SiblingAnswer answer = ToItsEnd(stage, job, progress);
    if (!earlier || !stage.wanted.empty()) return answer;
    // The job's inputs may have changed since it began: the program is run again and finds out.
    job.id.clear();
    const SiblingAnswer again = ToItsEnd(stage, job, progress);
    return HadNothingToDo(again.summary) ? answer : again;
  }

  std::vector<SiblingAnswer> RunAll(const std::vector<ExecutedStage>& stages, const std::string& task,
                                    ProgressSink& progress) override {
    CheckInterrupted();
    std::vector<Job> jobs;
    std::vector<std::size_t> fresh;
    for (const ExecutedStage& stage : stages) {
      jobs.push_back(JobFor(stage, progress));
      if (jobs.back().id.empty()) fresh.push_back(jobs.size() - 1);
    }
    if (fresh.size() > 1) SubmitArray(stages, fresh, jobs, progress);
    std::vector<SiblingAnswer> answers(stages.size());
    std::vector<std::exception_ptr> failures(stages.size());
    {
      Progress steps(progress, task, static_cast<long>(stages.size()));
      std::mutex mutex;
      std::atomic<std::size_t> next = 0;
      std::vector<std::jthread> followers;
      for (std::size_t t = 0; t < std::min(kMostFollowed, stages.size()); ++t)
        followers.emplace_back([&] {
          for (std::size_t i; (i = next++) < stages.size();) {
            NamedRemarks remarks(progress, mutex, {});
            try {
              answers[i] = ToItsEnd(stages[i], jobs[i], remarks);
              steps.Step();
            } catch (...) {
              failures[i] = std::current_exception();
            }
          }
        });
    }
    // Where a task failed, its array's folder says more; where one goes on, it works there.
    for (const std::exception_ptr& failure : failures)
      if (failure) std::rethrow_exception(failure);
    RemoveArrays();
    return answers;
  }

 private:
  // A stage's job: as an earlier run left it, or to be submitted (no id).
  struct Job {
    std::vector<std::string> command;
    JobFiles files;
    std::string id = {};
    bool earlier = false;  // it is not done, and another run submitted it
  };
  Job JobFor(const ExecutedStage& stage, ProgressSink& progress) {
    Job job{SiblingCommand(stage.sibling), JobFiles({})};
    std::string key;
    for (const std::string& part : job.command) key += part + '\0';
    job.files = JobFiles(options_.folder / (stage.name + "-" + HashOf(key + stage.wanted)));
    RequireNoOther(stage, job.files);
    Forget(stage, job.files);
    job.id = JobOf(job.files);
    job.earlier = !job.id.empty() && !TextOf(job.files.ended);
    if (job.earlier)
      progress.Message(fmt::format("{}: job {} was submitted by an earlier run, and is followed", stage.name, job.id));
    return job;
  }

  SiblingAnswer ToItsEnd(const ExecutedStage& stage, Job& job, ProgressSink& progress) {
    std::string& id = job.id;
    for (int submission = 1;; ++submission) {
      if (id.empty()) {
        id = Submit(stage, job.command, job.files);
        progress.Message(fmt::format("{}: job {}", stage.name, id));
      }
      try {
        if (auto answer = Follow(stage, id, job.files, job.earlier, progress)) return *std::move(answer);
      } catch (const Interrupted&) {
        if (InterruptRequested())
          progress.Message(fmt::format("{}: job {} goes on; the same command follows it, and scancel {} ends it",
                                       stage.name, id, id));
        else  // the program was interrupted on its node
          throw MachineError(fmt::format("{}: job {} was ended on its node", stage.name, id),
                             "the same command goes on from there", job.files.folder);
        throw;
      }
      if (submission == kMostSubmissions)
        throw MachineError(fmt::format("{}: lost its node {} times", stage.name, kMostSubmissions),
                           "sinfo says which nodes are down", job.files.folder);
      progress.Message(job.earlier
                           ? fmt::format("{}: job {} is gone, and is submitted again", stage.name, id)
                           : fmt::format("{}: job {} was lost with its node, and is submitted again", stage.name, id));
      job.earlier = false;
      id.clear();
    }
  }

  // A job of the same stage by other options, which an earlier run left in the queue: both would write one scene.
  void RequireNoOther(const ExecutedStage& stage, const JobFiles& own) const {
    constexpr std::size_t kHash = 17;  // with its dash
    std::error_code error;
    for (fs::directory_iterator it(options_.folder, error), end; !error && it != end; it.increment(error)) {
      const std::string name = it->path().filename().string();
      if (name.size() <= kHash || name.substr(0, name.size() - kHash) != stage.name || it->path() == own.folder)
        continue;
      const JobFiles other(it->path());
      if (TextOf(other.ended)) continue;
      if (const std::string id = JobOf(other); !id.empty() && IsAlive(id))
        throw MachineError(
            fmt::format("{}: job {} of an earlier run with other options or inputs is not done", stage.name, id),
            fmt::format("wait for it, or end it: scancel {}", id), other.folder);
    }
  }

  static bool IsAlive(const std::string& id) {
    const Printed p = Command({"scontrol", "show", "job", id, "--oneliner"});
    return p.code == 0 && !HasEnded(JobStateFrom(p.out));
  }
  static bool HasEnded(const JobState& job) {
    constexpr std::array<std::string_view, 10> kFinal = {"COMPLETED", "FAILED",    "CANCELLED",     "TIMEOUT",
                                                         "DEADLINE",  "NODE_FAIL", "OUT_OF_MEMORY", "BOOT_FAIL",
                                                         "PREEMPTED", "REVOKED"};
    return std::ranges::find(kFinal, std::string_view(job.state)) != kFinal.end();
  }

  // Removes what an earlier run left where that run failed, or where it may have had other inputs.
  static void Forget(const ExecutedStage& stage, const JobFiles& files) {
    const auto ended = TextOf(files.ended);
    if (!ended || (FirstLine(*ended) == "0" && !stage.wanted.empty())) return;
    std::error_code ignored;
    fs::remove_all(files.folder, ignored);
  }

  static std::string NameOf(const JobFiles& files) { return "lumi-" + files.folder.filename().string(); }

  // The id of the job that these files belong to; found by the job's name where an earlier run ended after it submitted
  // the job and before it wrote the id.
  static std::string JobOf(const JobFiles& files) {
    if (const auto id = TextOf(files.id)) return FirstLine(*id);
    if (!TextOf(files.script)) return {};
    if (const auto array = TextOf(files.array)) {
      const std::size_t space = array->rfind(' ');
      const std::string index = "_" + FirstLine(array->substr(space + 1));
      std::istringstream tasks(Command({"squeue", "-h", "-r", "--name=" + array->substr(0, space), "-o", "%F_%K"}).out);
      for (std::string id; tasks >> id;)
        if (id.ends_with(index)) return id;
      return {};
    }
    return JobIdFrom(Command({"squeue", "-h", "--name=" + NameOf(files), "-o", "%A"}).out);
  }

  std::string Submit(const ExecutedStage& stage, const std::vector<std::string>& command, const JobFiles& files) {
    std::error_code error;
    {
      const std::lock_guard lock(folder_mutex_);
      fs::remove_all(files.folder, error);
      WriteTextAtomically(files.script, ScriptOf(command, files));
    }
    const std::string id = Sbatch(stage, NameOf(files), files.script, {"--output=slurm.txt"});
    WriteTextAtomically(files.id, id + "\n");
    return id;
  }

  // The id of a job that sbatch was given. The script is removed where it was refused.
  std::string Sbatch(const ExecutedStage& stage, const std::string& name, const fs::path& script,
                     const std::vector<std::string>& more) {
    // Output not by its whole path: a % there would be a pattern of Slurm's.
    std::vector<std::string> argv{"sbatch",
                                  "--parsable",
                                  "--requeue",
                                  "--open-mode=append",
                                  "--job-name=" + name,
                                  "--chdir=" + script.parent_path().string()};
    argv.insert(argv.end(), more.begin(), more.end());
    if (!options_.partition.empty()) argv.push_back("--partition=" + options_.partition);
    argv.push_back(options_.cpus > 0 ? fmt::format("--cpus-per-task={}", options_.cpus) : "--exclusive");
    argv.insert(argv.end(), options_.options.begin(), options_.options.end());
    argv.push_back(script.string());
    const Printed p = Command(argv);
    const std::string id = JobIdFrom(p.out);
    if (p.code != 0 || id.empty()) {
      std::error_code error;
      fs::remove(script, error);
      throw MachineError(fmt::format("{}: sbatch refused the job: {}", stage.name, p.said.empty() ? p.out : p.said),
                         "sinfo shows partitions and nodes; --partition and --sbatch-option choose");
    }
    return id;
  }

  // One job array for the stages numbered `fresh`. A task that is lost later is submitted again as a job of its own.
  void SubmitArray(const std::vector<ExecutedStage>& stages, const std::vector<std::size_t>& fresh,
                   std::vector<Job>& jobs, ProgressSink& progress) {
    std::string tasks;
    for (std::size_t k = 0; k < fresh.size(); ++k)
      tasks += fmt::format("{}) exec sh {} ;;\n", k, ShellWord(jobs[fresh[k]].files.script.string()));
    const std::string name = kArray + HashOf(tasks);
    const fs::path folder = options_.folder / name, script = folder / "tasks.sh";
    std::error_code error;
    fs::remove_all(folder, error);
    for (std::size_t k = 0; k < fresh.size(); ++k) {
      const Job& job = jobs[fresh[k]];
      fs::remove_all(job.files.folder, error);
      WriteTextAtomically(job.files.array, fmt::format("lumi-{} {}\n", name, k));
      WriteTextAtomically(job.files.script, ScriptOf(job.command, job.files));
    }
    WriteTextAtomically(script, "#!/bin/sh\ncase $SLURM_ARRAY_TASK_ID in\n" + tasks + "esac\n");
    std::string id;
    try {
      id = Sbatch(stages[fresh.front()], "lumi-" + name, script,
                  {fmt::format("--array=0-{}", fresh.size() - 1), "--output=slurm-%a.txt"});
    } catch (const MachineError&) {
      for (const std::size_t i : fresh) fs::remove_all(jobs[i].files.folder, error);
      fs::remove_all(folder, error);
      throw;
    }
    for (std::size_t k = 0; k < fresh.size(); ++k) {
      Job& job = jobs[fresh[k]];
      job.id = fmt::format("{}_{}", id, k);
      // Where the task has begun it has written its id itself.
      if (!TextOf(job.files.id)) WriteTextAtomically(job.files.id, job.id + "\n");
    }
    progress.Message(fmt::format("{}: job array {}, {} tasks", stages[fresh.front()].name, id, fresh.size()));
  }

  // Also those of earlier runs: their tasks have ended.
  void RemoveArrays() {
    std::vector<fs::path> arrays;
    std::error_code error;
    for (fs::directory_iterator it(options_.folder, error), end; !error && it != end; it.increment(error))
      if (it->path().filename().string().starts_with(kArray)) arrays.push_back(it->path());
    for (const fs::path& array : arrays) fs::remove_all(array, error);
    fs::remove(options_.folder, error);  // where they were the last ones
  }

  // The job's answer; nullopt: the job was lost with its node. Throws what the program failed with. earlier: the job
  // was submitted by another run; if it is gone without an answer, that is not an error of this run, and nullopt too.
  std::optional<SiblingAnswer> Follow(const ExecutedStage& stage, const std::string& id, const JobFiles& files,
                                      bool earlier, ProgressSink& progress) {
    SiblingOutput output(stage.sibling, progress);
    NewLines lines(files.lines);
    Stopwatch looked;
    const Stopwatch followed;
    double gone_at = -1, silent_at = -1;  // since when, by `followed`; < 0: neither gone nor silent
    double pause = std::min(kFirstPauseSeconds, options_.poll_seconds);
    std::error_code ignored;
    std::string waiting;
    for (bool first = true;; first = false) {
      CheckInterrupted();
      if (gone_at >= 0) (void)fs::directory_iterator(files.folder, ignored);  // a network file system looks again
      if (const auto ended = TextOf(files.ended)) {
        lines.Read([&](const std::string& line) { output.Line(line); }, true);
        return Answer(stage, id, *ended, files, output, progress);
      }
      lines.Read([&](const std::string& line) { output.Line(line); }, false);
      if (first || looked.Seconds() >= options_.look_seconds) {
        looked.Lap();
        const Printed p = Command({"scontrol", "show", "job", id, "--oneliner"});
        const JobState job = JobStateFrom(p.out);
        // Of an array's task it says so in other words, and on the other stream.
        const bool unknown = p.code != 0 && (p.said.find("Invalid job id") != std::string::npos ||
                                             p.out.find("not found") != std::string::npos);
        if (p.code != 0 && !unknown) {
          // The controller may be restarting: jobs go on without it.
          if (silent_at < 0) silent_at = followed.Seconds();
          if (followed.Seconds() - silent_at > kControllerSeconds)
            throw MachineError(fmt::format("{}: Slurm's controller does not answer: {}", stage.name, p.said),
                               fmt::format("job {} may go on; the same command follows it", id), files.folder);
        } else {
          silent_at = -1;
          const bool alive = !unknown && !HasEnded(job);
          if (alive) {
            gone_at = -1;
            // Slurm holds a job back for two minutes when it requeues it after a lost node; that wait has no use here.
            if (job.state == "PENDING" && job.reason == "BeginTime" && job.restarts > 0)
              Command({"scontrol", "update", "JobId=" + id, "StartTime=now"});
            if (job.state == "PENDING" && job.reason != waiting)
              progress.Message(fmt::format("{}: job {} waits ({})", stage.name, id, waiting = job.reason));
          } else {
            if (gone_at < 0) gone_at = followed.Seconds();
            // Only a script that ran to its end has an answer, which may appear late.
            const bool may_come = job.state == "COMPLETED" || job.state == "FAILED";
            if (followed.Seconds() - gone_at > (may_come ? 1 : kShare) * options_.late_seconds) {
              if (!earlier) RequireNodeLost(stage, id, job, files);
              return std::nullopt;
            }
          }
        }
      }
      std::this_thread::sleep_for(std::chrono::duration<double>(pause));
      const double longest = followed.Seconds() < kShortJobSeconds ? kShortJobPause : options_.poll_seconds;
      pause = std::min({1.3 * pause, longest, options_.poll_seconds});
    }
  }

  // Throws for a job without an answer that somebody or something ended; returns where its node was lost.
  static void RequireNodeLost(const ExecutedStage& stage, const std::string& id, const JobState& job,
                              const JobFiles& files) {
    const auto fail = [&](const std::string& what, const std::string& hint) {
      std::error_code ignored;
      for (const fs::path& file : {files.id, files.script}) fs::remove(file, ignored);  // the next run submits its own
      throw MachineError(fmt::format("{}: job {} {}", stage.name, id, what), hint, files.folder);
    };
    if (job.state == "CANCELLED") fail("was cancelled", "the same command submits it anew");
    if (job.state == "TIMEOUT" || job.state == "DEADLINE")
      fail("ran into its time limit", "give it more: --sbatch-option=--time=MINUTES; what it finished is kept");
    if (job.state == "OUT_OF_MEMORY")
      fail("ran out of memory", "give it more: --sbatch-option=--mem=MEGABYTES; what it finished is kept");
    if (job.state == "FAILED" || job.state == "COMPLETED")
      fail(fmt::format("ended ({}) without an answer", job.state),
           "its folder, these programs and the scene must be at the same paths on all nodes; slurm.txt there, or the "
           "array's slurm-K.txt beside it, says more");
  }

  std::optional<SiblingAnswer> Answer(const ExecutedStage& stage, const std::string& id, const std::string& ended,
                                      const JobFiles& files, SiblingOutput& output, ProgressSink& progress) {
    int code = -1;
    const std::string word = FirstLine(ended);
    std::from_chars(word.data(), word.data() + word.size(), code);
    double start = 0, stop = 0;
    if (std::ifstream in(files.seconds); !(in >> start >> stop)) start = stop = 0;
    const std::string out = TextOf(files.answer).value_or("");
    if (code != 0)
      progress.Message(fmt::format("{}: job {} failed on {}; what it said is in {}", stage.name, id,
                                   FirstLine(TextOf(files.node).value_or("?")), files.lines.string()));
    const SiblingAnswer answer = output.Answer(code, out, stop - start);
    std::error_code ignored;
    const std::lock_guard lock(folder_mutex_);
    fs::remove_all(files.folder, ignored);
    fs::remove(files.folder.parent_path(), ignored);  // the last one
    return answer;
  }

  SlurmOptions options_;
  std::mutex folder_mutex_;  // while a job's folder comes or goes
};

}  // namespace

std::string JobIdFrom(const std::string& printed) {
  const std::string id = printed.substr(0, printed.find_first_of(";\n"));
  return !id.empty() && id.find_first_not_of("0123456789") == std::string::npos ? id : std::string();
}

JobState JobStateFrom(const std::string& shown) {
  const auto value = [&](const std::string& key) {
    const std::size_t at = shown.find(key + "=");
    if (at == std::string::npos || (at > 0 && shown[at - 1] != ' ')) return std::string();
    const std::size_t begin = at + key.size() + 1;
    return shown.substr(begin, shown.find_first_of(" \n", begin) - begin);
  };
  const std::string restarts = value("Restarts");
  JobState job{value("JobState"), value("Reason")};
  std::from_chars(restarts.data(), restarts.data() + restarts.size(), job.restarts);
  return job;
}

std::shared_ptr<Executor> MakeSlurmExecutor(const SlurmOptions& options) {
  return std::make_shared<SlurmExecutor>(options);
}

}  // namespace lumi
