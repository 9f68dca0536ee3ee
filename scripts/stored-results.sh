#!/usr/bin/env bash
# Shows what other versions of the libraries change in results that are not pictures (those: scripts/stored-renders.sh).
#
#   scripts/stored-results.sh inputs INPUTS        simulates what is measured, once: boards, a lamp that turns, a desk
#   scripts/stored-results.sh measure INPUTS OUT   calibration, period, factorisation, COLMAP: a summary (.json) each,
#                                                  and COLMAP's cameras of two seeds
#   scripts/stored-results.sh compare OLD NEW      a row for each summary: the number that differs most, by how much;
#                                                  then how far COLMAP's cameras are apart: between seeds, between OLD
#                                                  and NEW, from the truth
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
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' "$me"; exit 0 ;;
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

# Times, paths and the machine are not kept.
kept() {
  grep -v '"\([a-z_]*ms\|[a-z_]*seconds\|device\|scene\|file\|camera\|report\)":' >"$1.part" && mv "$1.part" "$1"
}
# Of a scene what says where its cameras are: photos are large, and the same everywhere.
keep_cameras() {
  mkdir -p "$2"
  cp -r "$1/lumigraph.json" "$1/sparse" "$2/"
}
measure() {
  local in=$1 out=$2 work focal seed one_thread
  mkdir -p "$out/summaries"
  work=$(mktemp -d)
  # shellcheck disable=SC2064
  trap "rm -rf '$work'" EXIT
  one_thread=(--json --quiet --threads 1)
  "$bin/lumi-calibrate" "$in/boards/images" --board 9x6 --square-mm 25 -o "$work/camera.yaml" "${one_thread[@]}" |
    kept "$out/summaries/calibration.json"
  "$bin/lumi-timeperiodic" period "$in/lamp/fixed.mp4" "${one_thread[@]}" | kept "$out/summaries/period.json"
  focal=$(grep -m1 -A1 '"params"' "$in/plaza/truth/cameras.json" | sed -n '2s/[^0-9.]//gp')
  "$bin/lumi-reconstruct" "$in/plaza/video.mp4" -o "$work/plaza" --backend factorization --focal-px "$focal" \
    "${one_thread[@]}" | kept "$out/summaries/factorization.json"
  rm -rf "$out/cameras"
  keep_cameras "$in/desk" "$out/cameras/truth"
  for seed in 1 2; do
    "$bin/lumi-reconstruct" "$in/desk/images" -o "$work/desk-$seed" --json --quiet --seed $seed |
      kept "$out/summaries/colmap-seed-$seed.json"
    keep_cameras "$work/desk-$seed" "$out/cameras/seed-$seed"
  done
}

camera_row() {
  "$bin/pose_difference" "$2" "$3" --json --quiet | awk -F '[:,]' -v what="$1" '
    { gsub(/[ "]/, ""); value[$1] = $2 }
    END {
      printf "%-30s %5d", what, value["views_matched"]
      printf " %10.4f %10.4f", value["centre_rms_percent"], value["centre_max_percent"]
      printf " %10.4f %10.4f", value["rotation_rms_deg"], value["rotation_max_deg"]
      printf " %10.4f\n", value["focal_max_percent"]
    }'
}
compare() {
  local old=$1 new=$2 status=0 seed
  [ -x "$bin/pose_difference" ] || die "there is no $bin/pose_difference: build it, or name its folder with --bin" 2
  scripts/stored-renders.sh compare "$old/summaries" "$new/summaries" --figures 0 || status=$?
  printf '\n%-30s %5s %21s %21s %10s\n' "COLMAP's cameras" '' 'centres, % of extent' 'rotations, degrees' 'focal, %'
  printf '%-30s %5s %10s %10s %10s %10s %10s\n' '' views rms max rms max max
  camera_row 'old, seeds 1 and 2' "$old/cameras/seed-1" "$old/cameras/seed-2"
  camera_row 'new, seeds 1 and 2' "$new/cameras/seed-1" "$new/cameras/seed-2"
  for seed in 1 2; do
    camera_row "old and new, seed $seed" "$old/cameras/seed-$seed" "$new/cameras/seed-$seed"
    camera_row "old and the truth, seed $seed" "$old/cameras/seed-$seed" "$old/cameras/truth"
    camera_row "new and the truth, seed $seed" "$new/cameras/seed-$seed" "$new/cameras/truth"
  done
  return $status
}

case $command in
  inputs) folders 1; inputs "${words[1]}" ;;
  measure) folders 2; measure "${words[1]}" "${words[2]}" ;;
  compare) folders 2; compare "${words[1]}" "${words[2]}" ;;
  *) die "inputs, measure or compare (see --help)" 2 ;;
esac
