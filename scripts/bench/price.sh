#!/usr/bin/env bash
# What the whole pipeline costs at each quality: minutes against the error of left-out photos, of desk, and of fox below --data
# Programs: lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export
. "${BASH_SOURCE[0]%/*}/common.sh"

simulated desk-capture desk --views 24 --width 640
# price NAME INPUT: a table of lumi-pipeline's CSV.
price() {
  rm -rf "$work/price/$1"  # minutes of this build
  "$bin/lumi-pipeline" "$2" -o "$work/price/$1" --tradeoff --no-video --no-web --quiet >/dev/null
  heading "What the whole pipeline costs: $1"
  printf '| quality | minutes | cameras | proxy | most of it | photos | choosing fold, dB | PSNR dB | seen dB | SSIM |\n|---|---|---|---|---|---|---|---|---|---|\n'
  awk -F, '
    function figure(key, decimals) { return $at[key] == "" ? "-" : sprintf("%." decimals "f", $at[key]) }
    { gsub(/"/, "") }
    NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; next }
    {
      printf "| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n", $at["quality"], figure("minutes", 1), figure("camera_minutes", 1), figure("proxy_minutes", 1),
        $at["dominates"], $at["photos"], figure("choosing_db", 2), figure("psnr_db", 2), figure("psnr_seen_db", 2), figure("ssim", 3)
    }' "$work/price/$1/tradeoff/pipeline.csv"
}
price desk "$work/desk-capture/images"
[ ! -d "${data:-/nowhere}/fox" ] || price fox "$data/fox/images"
