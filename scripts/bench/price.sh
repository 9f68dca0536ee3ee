#!/usr/bin/env bash
# What the whole pipeline costs at each quality: minutes against the error of left-out photos, of desk, and of fox below --data
# Programs: lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export
. "${BASH_SOURCE[0]%/*}/common.sh"

simulated desk-capture desk --views 24 --width 640
# price NAME INPUT: a table of lumi-pipeline's CSV.
price() {
  "$bin/lumi-pipeline" "$2" -o "$work/price/$1" --tradeoff --no-video --no-web --quiet >/dev/null
  heading "What the whole pipeline costs: $1"
  printf '| quality | minutes | cameras | proxy | most of it | photos | PSNR dB | seen dB | SSIM |\n|---|---|---|---|---|---|---|---|---|\n'
  awk -F, '
    NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; next }
    {
      printf "| %s | %.1f | %.1f | %.1f | %s | %s | %.2f | %.2f | %.3f |\n", $at["quality"], $at["minutes"], $at["camera_minutes"], $at["proxy_minutes"],
        $at["dominates"], $at["photos"], $at["psnr_db"], $at["psnr_seen_db"], $at["ssim"]
    }' "$work/price/$1/tradeoff/pipeline.csv"
}
price desk "$work/desk-capture/images"
[ ! -d "${data:-/nowhere}/fox" ] || price fox "$data/fox/images"
