#!/usr/bin/env bash
# What --effects auto decides, against an effect off and on; sharpness weights on blurred photos
# Programs: lumi-simulate lumi-render lumi-pipeline lumi-reconstruct lumi-proxy lumi-export bench_figures
. "${BASH_SOURCE[0]%/*}/common.sh"

# What --effects auto decides by judgement, against the other way: held-out PSNR in dB.
effects_row() {
  local row options json
  row="| ${1##*/} | $2 |"
  for options in '' '--prefilter off' '--prefilter on' '--resolution off' '--resolution jacobian'; do
    # shellcheck disable=SC2086
    json=$("$bin/lumi-render" "$1" --holdout 8 --width "$2" $options --json --quiet)
    row+=" $(json_figure "$json" psnr_mean_db) |"
  done
  printf '%s\n' "$row"
}
heading 'Effects on demand: auto, and an effect off or on'
printf '| capture | width | auto | prefilter off | on | resolution off | Jacobian |\n|---|---|---|---|---|---|---|\n'
for scene in desk fox sceaux fountain; do
  captured "$scene" || continue
  for width in 160 320 640; do effects_row "$work/$scene" "$width"; done
done

# Photos that are left out are sharp; off last, as its cost is measured beside.
blurred=$work/plaza-blurred
simulated plaza-blurred plaza --views 36 --width 480 --blur-s 0.08 --blur-every 3
sharpness_row() {
  local label=$1 json
  shift
  json=$("$bin/lumi-render" "$blurred" --holdout 6 --json --quiet "$@")
  printf '| %s | %s | %s |\n' "$label" "$(json_figure "$json" psnr_mean_db)" "$(json_figure "$json" ms_per_frame 1)"
}
heading 'Sharpness: plaza with every third photo blurred by motion'
printf '| `--delta` | held-out PSNR, dB | ms a frame |\n|---|---|---|\n'
for delta in 1 2 4 8 20; do sharpness_row "$delta" --sharpness on --delta "$delta"; done
sharpness_row 'auto (4)'
sharpness_row off --sharpness off
