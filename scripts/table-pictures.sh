#!/usr/bin/env bash
# The pictures beside docs/benchmark.md's Table 3.1, of the simulated hallway: where ticks differ from the thesis's.
#
#   scripts/table-pictures.sh OUT     OUT/table-3-1.jpg and OUT/table-3-1-ray.jpg (some minutes)
#     --bin DIR   programs that are built already; default: build/release/bin
#     --work DIR  where the capture is kept; default: build/bench, as bench.sh keeps it
# table-3-1.jpg: a left-out view in false colours (a colour a photo) by this renderer, Gortler 1996, Debevec 1998; its photo, by this renderer, Levoy 1996.
# table-3-1-ray.jpg: a row a method, the photos along one ray in false colours.
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/common.sh

absolute() { case $1 in /*) printf '%s' "$1" ;; *) printf '%s' "$start_folder/$1" ;; esac; }
bin=build/release/bin captures=build/bench out=''
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,8s/^# \{0,1\}//p' scripts/table-pictures.sh; exit 0 ;;
    --bin | --work)
      [ $# -ge 2 ] || die "$1 needs a value" 2
      case $1 in --bin) bin=$(absolute "$2") ;; --work) captures=$(absolute "$2") ;; esac
      shift 2 ;;
    -*) die "$1 is no option (see --help)" 2 ;;
    *) [ -z "$out" ] || die "one folder is wanted, not also $1" 2
      out=$(absolute "$1"); shift ;;
  esac
done
[ -n "$out" ] || die "OUT is wanted (see --help)" 2
mkdir -p "$out" "$captures"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

hallway=$captures/hallway-60
[ -d "$hallway/truth" ] || "$bin/lumi-simulate" --example hallway --views 60 --width 320 -o "$hallway" --quiet >/dev/null
[ -f "$hallway/proxies/tube.ply" ] || "$bin/lumi-proxy" import scripts/thesis-figures/hallway.obj "$hallway" --name tube --quiet >/dev/null

# rendered METHOD OPTIONS...: into $work/one.
rendered() {
  local method=$1
  shift
  rm -rf "$work/one"
  "$bin/lumi-render" "$hallway" --proxy tube --method "$method" "$@" -o "$work/one" --quiet >/dev/null
}
tiles=()
# tile PICTURE
tile() {
  oiiotool "$1" --ch R,G,B --resize 240x180 -o "$work/tile-${#tiles[@]}.png"
  tiles+=("$work/tile-${#tiles[@]}.png")
}
for method in ulr gortler-1996 debevec-1998; do
  rendered "$method" --view 30 --leave-out --show false-color
  tile "$(find "$work/one" -name '*.png' | head -n 1)"
done
tile "$(find "$hallway/images" -type f | sort | sed -n 31p)"
for method in ulr levoy-hanrahan-1996; do
  rendered "$method" --view 30 --leave-out
  tile "$(find "$work/one" -name '*.png' | head -n 1)"
done
oiiotool "${tiles[@]}" --mosaic:pad=4 3x2 --ch R,G,B -o "$work/table.png"
jpeg_for_docs "$work/table.png" 3 "$out/table-3-1.jpg"

# Along one ray of hallway: the camera moves down its own axis, and the middle pixel keeps its ray.
awk -v turn=0.35 -v steps=60 'BEGIN {
  half = sqrt(0.5)
  printf "{\"format\": \"lumigraph-path\", \"version\": 1, \"fps\": %d, \"width\": 33, \"height\": 25, \"keys\": [", steps
  for (i = 0; i <= 1; ++i)
    printf "%s{\"time_s\": %d, \"position\": [%.6f, %.6f, 1.25], \"cam_from_world_xyzw\": [%.9f, %.9f, %.9f, %.9f], \"vertical_fov_deg\": 10}",
      i ? ", " : "", i, 2.2 * i * sin(turn) - 0.4, 6 + 2.2 * i * cos(turn), half * cos(turn / 2), -half * sin(turn / 2), half * sin(turn / 2), half * cos(turn / 2)
  print "]}"
}' >"$work/ray.json"
strips=()
along=(ulr debevec-1996 pulli-1997 chen-williams-1993 debevec-1998 heigl-1999 sibr-ulr)
for method in "${along[@]}"; do
  rendered "$method" --path "$work/ray.json" --show false-color --effects fov,visibility
  middles=()
  for frame in "$work"/one/frames/*.png; do
    oiiotool "$frame" --ch R,G,B --cut 1x1+16+12 --resize:filter=box 8x16 -o "$frame.middle.png"
    middles+=("$frame.middle.png")
  done
  oiiotool "${middles[@]}" --mosaic "${#middles[@]}x1" -o "$work/strip-$method.png"
  strips+=("$work/strip-$method.png")
done
oiiotool "${strips[@]}" --mosaic:pad=2 "1x${#strips[@]}" --ch R,G,B -o "$work/rays.png"
jpeg_for_docs "$work/rays.png" 3 "$out/table-3-1-ray.jpg"
say "$out/table-3-1.jpg, table-3-1-ray.jpg: ${along[*]}"
