#!/usr/bin/env bash
# Installs and builds what the tests need, and runs them.
#
#   ./test.sh             the fast tier
#   ./test.sh --all       everything, also what takes minutes or needs the captures in ../shared/data
#   ./test.sh --asan      the fast tier without the end-to-end tests, with address and undefined-behaviour checks
#   further arguments go to ctest (-R NAME, -L hard-case ...)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
. scripts/common.sh

preset=release
select=(-LE slow)
more=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,7s/^# \{0,1\}//p' "${BASH_SOURCE[0]##*/}"; exit 0 ;;
    --all) select=() ;;
    --asan) preset=asan-ubsan; select=(-LE 'slow|end-to-end') ;;
    *) more+=("$1") ;;
  esac
  shift
done

install_packages
build "$preset" all
# COLMAP, OpenCV and Embree keep what they allocate until the end: leaks of ours show in the objects' own tests.
export ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1
# One more than there are cores: tests that start programs wait for them now and then.
status=0
ctest --test-dir "build/$preset" -j "$(($(nproc) + 1))" --output-on-failure --no-tests=error "${select[@]}" "${more[@]}" || status=$?
# ctest counts executables: what one skipped beside tests that ran is said here.
grep -h '^skipped: ' "build/$preset/Testing/Temporary/LastTest.log" >&2 || true
exit $status
