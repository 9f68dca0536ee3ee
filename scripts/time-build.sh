#!/usr/bin/env bash
# What it costs to build and to test this project from nothing: a clean clone of the last commit, no compiler cache.
#
#   scripts/time-build.sh [--no-tests] [--keep]     takes as long as the build and the tests; --keep leaves the clone
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
tests=yes keep=no
for option; do
  case $option in
    --no-tests) tests=no ;;
    --keep) keep=yes ;;
    *) sed -n '2,4s/^# \{0,1\}//p' "scripts/${BASH_SOURCE[0]##*/}"; [ "$option" = -h ] || [ "$option" = --help ]; exit ;;
  esac
done

folder=$(mktemp -d)
if [ "$keep" = yes ]; then echo "in $folder"; else trap 'rm -rf "$folder"' EXIT; fi
git clone -q --no-hardlinks . "$folder/clone"
[ ! -e ../shared ] || ln -s "$(realpath ../shared)" "$folder/shared"  # captures that some tests look for
cd "$folder/clone"
. scripts/common.sh
export CCACHE_DISABLE=1
log=build/release/.ninja_log

step() {  # step NAME command...: its seconds
  local name=$1 begin
  shift
  begin=$(date +%s)
  "$@"
  printf '%6d s  %s\n' $(($(date +%s) - begin)) "$name"
}

install_packages
step "build of what demo.sh needs" build release lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-simulate lumi-view
step "build of the rest" build release all
if [ "$tests" = yes ]; then
  step "tests" ctest --test-dir build/release -j "$(($(nproc) + 1))" -LE slow --output-on-failure >ctest.log || cat ctest.log
fi

printf '\ncompiler-seconds by target (jobs at once add up):\n'
awk -F'\t' '!/^#/ { seconds[$4] = ($2 - $1) / 1000 }
  END {
    for (output in seconds) {
      target = output
      if (match(target, /CMakeFiles\/[^\/]*\.dir/)) target = substr(target, 1, RSTART - 1) substr(target, RSTART + 11, RLENGTH - 15)
      else target = "archives and links"
      sum[target] += seconds[output]
      sum["all"] += seconds[output]
      if (output ~ /^tests\//) sum["all of tests/"] += seconds[output]
    }
    for (target in sum) printf "%8.1f  %s\n", sum[target], target
  }' "$log" | sort -rn
if [ -f ctest.log ]; then
  printf '\nseconds by test:\n'
  sed -nE 's/^ *[0-9]+\/[0-9]+ Test +#[0-9]+: ([^ ]+) .* ([0-9.]+) sec$/\2 \1/p' ctest.log | sort -rn | awk '{ printf "%8.1f  %s\n", $1, $2 }'
fi
