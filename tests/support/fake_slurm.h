// A cluster that is three shell scripts in PATH, which do as a test says by files in the folder $FAKE.
#pragma once

#include <filesystem>
#include <string>

#include "scene/files/atomic_file.h"

namespace lumi {

inline void WriteShellProgram(const std::filesystem::path& file, const std::string& text) {
  WriteTextAtomically(file, "#!/bin/sh\n" + text);
  std::filesystem::permissions(file, std::filesystem::perms::owner_all);
}

// sbatch, squeue and scontrol. What the Nth job does stands in do-N: nothing (it runs), or a word; of an array, "lost
// K" is what task K alone does. `submitted` has the command lines, `queued` what squeue prints; jobs that wait run when
// `go` is there, and no controller answers while `controller-down` is.
inline void WriteFakeSlurm(const std::filesystem::path& bin) {
  WriteShellProgram(bin / "sbatch", R"sh(n=$(($(cat "$FAKE/count" 2>/dev/null || echo 0) + 1))
echo $n >"$FAKE/count"
echo "$@" >>"$FAKE/submitted"
last=
for script; do case $script in --array=*) last=${script#--array=0-} ;; esac; done
do=$(cat "$FAKE/do-$n" 2>/dev/null)
# A job, or an array's tasks: its name, and where it is one of these its number.
for i in $([ -z "$last" ] && echo - || seq 0 $last); do
  name=$n
  [ $i = - ] || name=${n}_$i
  word=$do
  case $do in *" "*) [ "${do#* }" = "$i" ] && word=${do% *} || word= ;; esac
  run() { SLURM_JOB_ID=$name SLURM_ARRAY_TASK_ID=$i sh "$script"; echo COMPLETED >"$FAKE/state-$name"; }
  case $word in
    refuse) echo 'sbatch: error: invalid partition specified: nowhere' >&2; exit 1 ;;
    lost) echo NODE_FAIL >"$FAKE/state-$name" ;;
    forgotten) ;;
    cancelled) echo CANCELLED >"$FAKE/state-$name" ;;
    timeout) echo TIMEOUT >"$FAKE/state-$name" ;;
    mute) echo COMPLETED >"$FAKE/state-$name" ;;
    wait)
      (echo PENDING >"$FAKE/state-$name"
       while [ -d "$FAKE" ] && [ ! -e "$FAKE/go" ]; do sleep 0.05; done; [ -d "$FAKE" ] || exit
       echo RUNNING >"$FAKE/state-$name"
       run) >/dev/null 2>&1 & ;;
    *) (echo RUNNING >"$FAKE/state-$name"; run) >/dev/null 2>&1 & ;;
  esac
  # A job has a state once it has let go of sbatch's output: whoever called sbatch ends what holds that any longer.
  while [ "$word" != forgotten ] && [ ! -e "$FAKE/state-$name" ]; do sleep 0.01; done
done
echo "$n;cluster"
)sh");
  // Of a job by a name that was submitted.
  WriteShellProgram(bin / "squeue", R"sh(for word; do case $word in --name=*) name=${word#--name=} ;; esac; done
[ -z "$name" ] || [ ! -e "$FAKE/queued" ] || ! grep -q -e "--job-name=$name " "$FAKE/submitted" || cat "$FAKE/queued"
)sh");
  WriteShellProgram(bin / "scontrol",
                    R"sh([ ! -e "$FAKE/controller-down" ] ||
  { echo 'slurm_load_jobs error: Unable to contact slurm controller' >&2; exit 1; }
[ -e "$FAKE/state-$3" ] || case $3 in
  *_*) echo "Job $3 not found"; exit 1 ;;
  *) echo 'slurm_load_jobs error: Invalid job id specified' >&2; exit 1 ;;
esac
echo "JobId=$3 JobName=lumi UserId=root(0) JobState=$(cat "$FAKE/state-$3") Reason=Resources Dependency=(null)"
)sh");
}

}  // namespace lumi
