#!/usr/bin/env bash
# Prints every figure that README and docs quote, as Markdown; the same as JSON is in build/bench/figures.json.
#
#   ./bench.sh               on a desk that lumi-simulate photographs
#   ./bench.sh --data DIR    also on fountain, sceaux, fox, boards-stereo and boards-wide below DIR
#   ./bench.sh --only NAME   on one of them;  --views N photos rendered at their own cameras (4)
#   ./bench.sh --speed       only what rendering costs: the optimum, sparse samples and their blends on the CPU and in OpenGL, each
#                            beside its baseline; sparse samples against a weight a pixel on the 262 photos of the simulated desk, and
#                            on fox and knights below DIR
# Scenes are kept in build/bench: a second run measures again without finding the cameras again.
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")"
. scripts/common.sh

arguments=() data='' only_speed='' only_quality=''
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' "${BASH_SOURCE[0]##*/}"; exit 0 ;;
    --data)
      [ $# -ge 2 ] || die "--data needs a folder" 2
      case $2 in /*) data=$2 ;; *) data=$start_folder/$2 ;; esac
      [ -d "$data" ] || die "$data is no folder" 2
      arguments+=(--data "$data"); shift 2 ;;
    --speed) only_speed=1; shift ;;
    --only) only_quality=1; arguments+=("$1"); shift ;;
    *) arguments+=("$1"); shift ;;
  esac
done

install_packages
build release lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-simulate bench_figures calibration_bench optimum_bench sparse_blend_bench gl_blend_bench timeperiodic_bench test_calibrate test_calibrate_simulated_boards factorization_bench factorization_test real_captures_test reconstruct_data_test
bin=build/release/bin work=build/bench
mkdir -p "$work"
[ -n "$only_speed" ] || "$bin/bench_figures" --work "$work" "${arguments[@]}"
if [ -z "$only_speed$only_quality" ]; then
  printf '\n## Calibration\n\n'
  [ -z "$data" ] || "$bin/calibration_bench" "$data"
  printf '\nStandard deviations against the spread over 100 simulated sets, and ray-traced boards:\n\n```\n'
  "$bin/test_calibrate" --gtest_filter=Refinement.StandardDeviations* --gtest_brief=1 | grep ratio
  "$bin/test_calibrate_simulated_boards" --gtest_brief=1 | grep -E 'sigma|views'
  printf '```\n'
  # Against the desk's true cameras. A run's own row, "as given", is what lumi-reconstruct does without options.
  focal=$(grep -m1 -A1 '"params"' "$work/desk-capture/truth/cameras.json" | sed -n '2s/[^0-9.]//gp')
  # Held to their bounds by tests, which print what they see: a square, a drive and a desk, simulated, and a road.
  printf '\n## Cameras without COLMAP, against the truth\n\n```\n'
  "$bin/factorization_test" --gtest_filter='*CanBeLookedAt:FactorizedDrive.*' --gtest_brief=1 | grep centres
  "$bin/real_captures_test" --gtest_filter='DeskByFactorisation.*' --gtest_brief=1 | grep centres
  [ -z "$data" ] || "$bin/reconstruct_data_test" --gtest_filter='*Road*' --gtest_brief=1 | grep centres || true
  printf '```\n'
  printf '\nOn simulated tracks with 0.3 px of noise (rms P: projective, in px; rms M: metric; milliseconds a stage):\n\n```\n'
  "$bin/factorization_bench"
  printf '```\n'
  for example in lamp helicopter; do
    [ -d "$work/$example/truth" ] || "$bin/lumi-simulate" --example "$example" --width 240 -o "$work/$example"
  done
  printf '\n## Time-periodic scenes\n\n'
  "$bin/timeperiodic_bench" "$work" ${data:+"$data"}
  for backend in factorization colmap; do
    more=()
    [ "$backend" = colmap ] || more=(--focal-px "$focal")
    printf '\n## lumi-reconstruct --tradeoff: desk, %s\n\n```\n' "$backend"
    "$bin/lumi-reconstruct" "$work/desk-capture/images" -o "$work/desk-$backend" --backend "$backend" "${more[@]}" --tradeoff
    printf '```\n'
  done
fi
[ -z "$only_quality" ] || exit 0

heading() { printf '\n## %s\n\n' "$1"; }
# table TITLE COMMAND...: as it prints.
table() {
  heading "$1"
  shift
  printf '```\n'
  "$@"
  printf '```\n'
}
table 'The optimum (2 threads)' "$bin/optimum_bench"
table 'Sparse samples, CPU (2 threads)' "$bin/sparse_blend_bench" time views
table 'Sparse samples, OpenGL' "$bin/gl_blend_bench"

if [ ! -d "$work/desk-262" ]; then
  "$bin/lumi-simulate" --example desk -o "$work/desk-262"
  "$bin/lumi-proxy" plane "$work/desk-262"
fi
table 'Sparse samples against a weight a pixel: desk, foreground, plane' "$bin/sparse_blend_bench" psnr --scene "$work/desk-262" --proxy plane
table 'The same, true mesh' "$bin/sparse_blend_bench" psnr --scene "$work/desk-262" --proxy truth
if [ ! -d "$work/fox" ] && [ -n "$data" ] && [ -d "$data/fox" ]; then "$bin/bench_figures" --work "$work" --data "$data" --only fox >/dev/null; fi
if [ -d "$work/fox" ]; then
  for proxy in plane mesh; do table "The same: fox, $proxy" "$bin/sparse_blend_bench" psnr --scene "$work/fox" --proxy "$proxy"; done
fi
if [ -n "$data" ] && [ -d "$data/knights" ]; then
  if [ ! -d "$work/knights" ]; then
    # A rectified camera grid whose focal length is not given: 300 px is assumed.
    "$bin/lumi-reconstruct" "$data/knights/images" -o "$work/knights" --rig grid --grid-positions "$data/knights/positions.csv" --focal-px 300
    "$bin/lumi-proxy" plane "$work/knights"
  fi
  table 'The same: knights, plane' "$bin/sparse_blend_bench" psnr --scene "$work/knights" --proxy plane
fi
table 'The nine properties of Table 3.2: desk, plane' "$bin/lumi-render" properties "$work/desk-262" --proxy plane
