// Stages as jobs of a Slurm cluster: submitted by sbatch, followed by scontrol and by files that the jobs write, so
// that it works without accounting. A job outlives this program: a second start follows what is queued or runs, and
// takes the answer of what has ended. The scene, the input and these programs are on a file system that all nodes see,
// at the same paths.
//
// A stage's files, in FOLDER/NAME-HASH (of program and arguments): job.sh, id, answer.json, lines.txt (what the program
// says), node, ended (its exit code, written last). The folder goes when the answer has been read, and stays where the
// stage failed. Stages at the same time are one job array, whose tasks have such folders.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "pipeline/executor/executor.h"

namespace lumi {

struct SlurmOptions {
  std::string partition;             // empty: the cluster's default
  std::vector<std::string> options;  // passed on to sbatch: "--time=60"
  int cpus = 0;                      // of a job; 0: whole nodes
  std::filesystem::path folder;      // for the jobs' files
  double poll_seconds = 1;           // between two looks at a job's files
  double look_seconds = 5;           // between two questions to the controller, which cost it something
  double late_seconds = 90;          // that a network file system may show a file late
};

// Throws MachineError where Slurm's commands are not in PATH, or no cluster answers.
std::shared_ptr<Executor> MakeSlurmExecutor(const SlurmOptions& options);

// "12345;cluster" as sbatch --parsable prints it. Empty where it is none.
std::string JobIdFrom(const std::string& printed);

// What scontrol show job says of a state, "JobState=NODE_FAIL Reason=..."; empty where it does not know the job.
struct JobState {
  std::string state, reason;
  int restarts = 0;
};
JobState JobStateFrom(const std::string& shown);

}  // namespace lumi
