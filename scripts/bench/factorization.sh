#!/usr/bin/env bash
# Cameras by factorising tracks against the truth; lumi-reconstruct --tradeoff
# Programs: lumi-simulate lumi-reconstruct factorization_bench factorization_test real_captures_test reconstruct_data_test bench_figures
. "${BASH_SOURCE[0]%/*}/common.sh"

simulated desk-capture desk --views 24 --width 640
focal=$(grep -m1 -A1 '"params"' "$work/desk-capture/truth/cameras.json" | sed -n '2s/[^0-9.]//gp')
# Held to their bounds by tests, which print what they see: a square, a drive and a desk, simulated, and a road.
heading 'Cameras without COLMAP, against the truth'
printf '```\n'
"$bin/factorization_test" --gtest_filter='*CanBeLookedAt:FactorizedDrive.*' --gtest_brief=1 | grep centres
"$bin/real_captures_test" --gtest_filter='DeskByFactorisation.*' --gtest_brief=1 | grep centres
[ -z "$data" ] || "$bin/reconstruct_data_test" --gtest_filter='*Road*' --gtest_brief=1 | grep centres || true
printf '```\n'
# rms P: projective, in px; rms M: metric; milliseconds a stage.
block 'Factorisation of simulated tracks with 0.3 px of noise' "$bin/factorization_bench"
# Against the desk's true cameras. A run's own row, "as given", is what lumi-reconstruct does without options.
for backend in factorization colmap; do
  more=()
  [ "$backend" = colmap ] || more=(--focal-px "$focal")
  printf '\n## lumi-reconstruct --tradeoff: desk, %s\n\n```\n' "$backend"
  "$bin/lumi-reconstruct" "$work/desk-capture/images" -o "$work/desk-$backend" --backend "$backend" "${more[@]}" --tradeoff
  printf '```\n'
done
