#!/usr/bin/env bash
# Shows what other versions of the libraries change in results that are not pictures (those: scripts/stored-renders.sh).
#
#   scripts/stored-results.sh inputs INPUTS        simulates what is measured, once: boards, a lamp that turns, a desk
#   scripts/stored-results.sh measure INPUTS OUT   calibration, period, factorisation, COLMAP's cameras: a summary (.json) each
#   scripts/stored-results.sh compare OLD NEW      a row for each: its number that differs most, and by how much
#
#   --bin DIR         programs that are built already; default: build/release/bin
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/common.sh
me=$PWD/scripts/stored-results.sh
from_start() { case $1 in /*) echo "$1" ;; *) echo "$start_folder/$1" ;; esac; }

bin=$PWD/build/release/bin words=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,8s/^# \{0,1\}//p' "$me"; exit 0 ;;
    --bin) [ $# -ge 2 ] || die "$1 needs a folder" 2; bin=$(from_start "$2"); shift 2 ;;
    -*) die "$1 is no option (see --help)" 2 ;;
    *) words+=("$(from_start "$1")"); shift ;;
  esac
done
command=${words[0]:-}
command=${command##*/}
folders() { [ ${#words[@]} -eq $(($1 + 1)) ] || die "$command takes $1 names (see --help)" 2; }

inputs() {
  local in=$1
  mkdir -p "$in"
  [ -d "$in/boards" ] || "$bin/lumi-simulate" --example boards -o "$in/boards" --quiet
  [ -d "$in/lamp" ] || "$bin/lumi-simulate" --example lamp --width 240 -o "$in/lamp" --quiet
  [ -d "$in/desk" ] || "$bin/lumi-simulate" --example desk --views 24 --width 480 -o "$in/desk" --quiet
  [ -d "$in/plaza" ] || "$bin/lumi-simulate" --example plaza --video --views 72 --width 320 -o "$in/plaza" --quiet
}

# Times and the machine are not kept.
kept() { grep -v '"\([a-z_]*ms\|[a-z_]*seconds\|device\|scene\|file\|camera\)":' >"$1.part" && mv "$1.part" "$1"; }
measure() {
  local in=$1 out=$2 work focal
  mkdir -p "$out"
  work=$(mktemp -d)
  # shellcheck disable=SC2064
  trap "rm -rf '$work'" EXIT
  "$bin/lumi-calibrate" "$in/boards/images" --board 9x6 --square-mm 25 -o "$work/camera.yaml" --json --quiet --threads 1 | kept "$out/calibration.json"
  "$bin/lumi-timeperiodic" period "$in/lamp/fixed.mp4" --json --quiet --threads 1 | kept "$out/period.json"
  focal=$(grep -m1 -A1 '"params"' "$in/plaza/truth/cameras.json" | sed -n '2s/[^0-9.]//gp')
  "$bin/lumi-reconstruct" "$in/plaza/video.mp4" -o "$work/plaza" --backend factorization --focal-px "$focal" --json --quiet --threads 1 | kept "$out/factorization.json"
  "$bin/lumi-reconstruct" "$in/desk/images" -o "$work/desk" --json --quiet --seed 1 | kept "$out/colmap.json"
}

case $command in
  inputs) folders 1; inputs "${words[1]}" ;;
  measure) folders 2; measure "${words[1]}" "${words[2]}" ;;
  compare) folders 2; exec scripts/stored-renders.sh compare "${words[1]}" "${words[2]}" --figures 0 ;;
  *) die "inputs, measure or compare (see --help)" 2 ;;
esac
