#!/usr/bin/env bash
# Installs and builds what the tests need, and runs them.
#
#   ./test.sh             the fast tier
#   ./test.sh --all       everything, also what takes minutes or needs the captures in ../shared/data; builds what bench.sh runs;
#                         fuzzing where clang is installed; the Debian packages on a bare root; the site of docs/
#   ./test.sh --asan      the fast tier without the end-to-end tests, with address and undefined-behaviour checks
#   ./test.sh --tsan      viewer, loaders and threads of our own, with checks for data races
#   ./test.sh --on trixie [--as-user]     on a bare Debian of that name (bookworm, trixie), as root or as a user with sudo
#   further arguments go to ctest (-R NAME, -L hard-case ...)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
. scripts/common.sh

preset=release
select=(-LE slow) targets=(all)
more=() passed=() on='' as_user=() everything=''
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,10s/^# \{0,1\}//p' "${BASH_SOURCE[0]##*/}"; exit 0 ;;
    --all) select=() targets=(all benchmarks) everything=yes passed+=(--all) ;;
    --on)
      [ $# -ge 2 ] || die "--on needs the name of a release: bookworm or trixie" 2
      on=$2; shift ;;
    --as-user) as_user=(--as-user) ;;
    --asan) preset=asan-ubsan; select=(-LE 'slow|end-to-end') passed+=(--asan) ;;
    --tsan)
      # What starts threads or is read by several: the window and its loaders, caches of photos, frames in progress, scenes' files,
      # parallel loops, videos.
      preset=tsan targets=(viewer_core_test viewer_window_test test_render gl_renderer_test test_scene_files test_scene_program test_scene_tracks)
      select=(-R "^($(IFS='|'; echo "${targets[*]}"))\$") passed+=(--tsan) ;;
    *) more+=("$1") passed+=("$1") ;;
  esac
  shift
done
if [ -n "$on" ]; then
  exec scripts/clean-root.sh "${as_user[@]}" "$on" ./test.sh "${passed[@]}"
fi
[ ${#as_user[@]} -eq 0 ] || die "--as-user goes with --on" 2

install_packages
# The pages that lumi-export writes are looked at in a real browser; where there is none to be had, that test says so.
(install_packages chromium) || say "skipped: the pages of lumi-export in a browser (no Chromium)"
if [ -n "$everything" ]; then
  (install_packages slurmctld slurmd slurm-client munge) || say "skipped: stages as jobs of a Slurm cluster (no Slurm)"
fi
build "$preset" "${targets[@]}"
# COLMAP, OpenCV and Embree keep what they allocate until the end: leaks of ours show in the objects' own tests.
export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1
run=()
if [ "$preset" = tsan ]; then
  # Libraries of the system are not compiled with its checks. Its shadow memory wants addresses where they always are.
  # Threads of theirs (OpenImageIO has a pool) are not joined at the end.
  export TSAN_OPTIONS="ignore_noninstrumented_modules=1 report_thread_leaks=0 history_size=4"
  run=(setarch --addr-no-randomize)
fi
# One more than there are cores: tests that start programs wait for them now and then.
status=0
"${run[@]}" ctest --test-dir "build/$preset" -j "$(($(nproc) + 1))" --output-on-failure --no-tests=error "${select[@]}" "${more[@]}" || status=$?
# A short run of each fuzz target: most of what it takes is the build.
if [ -n "$everything" ] && [ $status -eq 0 ] && [ ${#more[@]} -eq 0 ]; then
  if printf 'extern "C" int LLVMFuzzerTestOneInput(const char*, unsigned long) { return 0; }' |
    clang++ -fsanitize=fuzzer,address -x c++ - -o "build/can-fuzz" 2>/dev/null; then
    ./fuzz.sh --runs 2000 || status=$?
  else
    say "skipped: fuzzing the readers (clang with its libFuzzer is not installed; ./fuzz.sh installs it)"
  fi
  rm -f build/can-fuzz
fi
# What is handed out: the Debian packages on a bare root, and the site of the documentation.
if [ -n "$everything" ] && [ $status -eq 0 ] && [ ${#more[@]} -eq 0 ]; then
  if [ "$(id -u)" -eq 0 ] && unshare --mount true 2>/dev/null; then
    scripts/package.sh --check || status=$?
  else
    say "skipped: Debian packages on a bare root (no root, or no mounts here)"
  fi
  scripts/site.sh || status=$?
fi
# ctest counts executables: what one skipped beside tests that ran is said here.
grep -h '^skipped: ' "build/$preset/Testing/Temporary/LastTest.log" >&2 || true
exit $status
