#!/usr/bin/env bash
# Fuzzes the readers of files with libFuzzer (clang), under address and undefined-behaviour checks. See docs/fuzzing.md.
#
#   ./fuzz.sh                     each target a minute, as many side by side as there are cores
#   ./fuzz.sh --minutes M         each target M minutes
#   ./fuzz.sh --runs N            each target N inputs instead
#   ./fuzz.sh --target NAME       that target only (may come several times)
#   ./fuzz.sh --list              names of the targets
#
# Needs clang (installed where it is missing). Seeds come from a scene that lumi-simulate makes; what a run finds new is kept in
# build/fuzz/corpus for the next one. Findings go to build/fuzz/findings/TARGET, and the exit code is 1.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
. scripts/common.sh

# The names stand in the sources: LUMI_FUZZ_TARGET(name).
all_targets() { sed -n 's/^LUMI_FUZZ_TARGET(\([a-z_]*\)).*/\1/p' tests/fuzz/*.cc | sort; }

minutes=1 runs='' targets=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,12s/^# \{0,1\}//p' "${BASH_SOURCE[0]##*/}"; exit 0 ;;
    --list) all_targets; exit 0 ;;
    --minutes | --runs | --target)
      [ $# -ge 2 ] || die "$1 needs a value" 2
      case $1 in --minutes) minutes=$2 ;; --runs) runs=$2 ;; --target) targets+=("$2") ;; esac
      shift ;;
    *) die "unknown option $1 (see --help)" 2 ;;
  esac
  shift
done
[[ $minutes =~ ^[0-9]+(\.[0-9]+)?$ && ($runs =~ ^[1-9][0-9]*$ || -z $runs) ]] || die "--minutes and --runs take numbers above 0" 2

mapfile -t known < <(all_targets)
[ ${#targets[@]} -gt 0 ] || targets=("${known[@]}")
for target in "${targets[@]}"; do
  [[ " ${known[*]} " == *" $target "* ]] || die "there is no target $target (see --list)" 2
done

install_packages clang libclang-rt-dev llvm
build release lumi-simulate
build fuzz "${targets[@]/#/fuzz-}" make_seeds

work=build/fuzz
seeds=$work/seeds corpus=$work/corpus findings=$work/findings logs=$work/logs
mkdir -p "$corpus" "$findings" "$logs"
# What is read as a file lies in memory, and goes with this script.
inputs=$(mktemp -d "$([ -w /dev/shm ] && echo /dev/shm || echo "${TMPDIR:-/tmp}")/lumi-fuzz.XXXXXX")
trap 'rm -rf "$inputs"' EXIT
export LUMI_FUZZ_FOLDER=$inputs
export ASAN_OPTIONS=quarantine_size_mb=16 UBSAN_OPTIONS=print_stacktrace=1

if [ ! -d "$seeds" ]; then
  say "making seeds ..."
  build/release/bin/lumi-simulate --example desk --views 4 --width 64 -o "$inputs/capture" --quiet
  build/release/bin/lumi-simulate --example lamp --views 8 --width 64 --video -o "$inputs/film" --quiet
  "$work/bin/make_seeds" "$inputs/capture" "$seeds.partial"
  # All but the street: reading its thousands of copies takes the time of a hundred inputs.
  cp simulate/examples/*.json "$seeds.partial/scene_description/"
  rm "$seeds.partial/scene_description/street.json"
  cp tests/scene/*.heic tests/scene/*.avif "$seeds.partial/photo/"
  mkdir -p "$seeds.partial/video"
  find "$inputs/film" -name '*.mp4' -size -64k -exec cp {} "$seeds.partial/video/" \;
  mv "$seeds.partial" "$seeds"
fi

# Numbers for all, JSON's words for what is JSON, the format's own.
dictionary() {
  local words=tests/fuzz/dictionaries
  cat "$words/numbers.dict"
  case $1 in
    *_json | *_path | manifest | point_pairs | provenance | scene_description | settings) cat "$words/json.dict" ;;
  esac
  cat "$words/$1.dict"
}

# Fuzzes one target; a line of what came of it. Time and memory are of an instrumented program: about ten times what a reader
# takes otherwise.
fuzz() {
  local target=$1 log=$logs/$1.log flags=(-max_len=65536 -timeout=30 -malloc_limit_mb=256 -rss_limit_mb=1024)
  # Decoders that are not ours nor instrumented: a small picture may have many pixels, and they keep what they allocate
  # (OpenImageIO the last message of each thread). They also take what 31 bits in a file claim, find its end, and give it
  # back untouched: what is resident counts.
  local leaks=1
  case $target in photo | video) leaks=0 flags=(-max_len=65536 -timeout=60 -malloc_limit_mb=2048 -rss_limit_mb=2048) ;; esac
  if [ -n "$runs" ]; then flags+=("-runs=$runs"); else flags+=("-max_total_time=$(awk "BEGIN { print int($minutes * 60 + 0.5) }")"); fi
  mkdir -p "$corpus/$target" "$findings/$target" "$seeds/$target" "tests/fuzz/regressions/$target"
  dictionary "$target" >"$work/$target.dict"
  local status=0
  ASAN_OPTIONS+=":detect_leaks=$leaks" "$work/bin/fuzz-$target" "${flags[@]}" -dict="$work/$target.dict" -print_final_stats=1 -artifact_prefix="$findings/$target/" \
    "$corpus/$target" "$seeds/$target" "tests/fuzz/regressions/$target" >"$log" 2>&1 || status=$?
  rmdir "tests/fuzz/regressions/$target" 2>/dev/null || true
  local count rate covered new finding=-
  count=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  rate=$(sed -n 's/^stat::average_exec_per_sec: *//p' "$log")
  covered=$(sed -n 's/^#[0-9]*.* cov: \([0-9]*\) .*/\1/p' "$log" | tail -n 1)
  new=$(find "$corpus/$target" -type f | wc -l)
  if [ $status -ne 0 ]; then
    finding=$(grep -aE -m 1 'CONTRACT:|runtime error:|ERROR: (AddressSanitizer|LeakSanitizer|libFuzzer)' "$log" | cut -c 1-160)
    echo "${finding:-exit code $status}" >"$findings/$target.failed"
  fi
  printf '%-18s %10s %8s %8s %8s  %s\n' "$target" "${count:-?}" "${rate:-?}" "${covered:-?}" "$new" "$finding"
}

rm -f "$findings"/*.failed
printf '%-18s %10s %8s %8s %8s  %s\n' target inputs per-s edges corpus finding
running=0
for target in "${targets[@]}"; do
  [ "$running" -lt "$(nproc)" ] || { wait -n || true; running=$((running - 1)); }
  fuzz "$target" &
  running=$((running + 1))
done
wait
if compgen -G "$findings/*.failed" >/dev/null; then
  say "findings are in $findings, what was said of them in $logs; docs/fuzzing.md says what to do with them"
  exit 1
fi
