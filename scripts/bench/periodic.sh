#!/usr/bin/env bash
# Time-periodic scenes from their videos alone, and what --tradeoff prints of their periods
# Programs: lumi-export lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-simulate lumi-timeperiodic timeperiodic_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

for example in lamp helicopter; do simulated "$example" "$example" --width 240; done
for example in 'lamp 150.37' 'helicopter 15.37'; do
  block "lumi-timeperiodic period --tradeoff: ${example% *}" \
    "$bin/lumi-timeperiodic" period "$work/${example% *}/fixed.mp4" --true-period "${example#* }" --tradeoff "$work/${example% *}-period"
done
block 'lumi-timeperiodic calibrate --tradeoff: helicopter' \
  "$bin/lumi-timeperiodic" calibrate "$work/helicopter/video.mp4" -o "$work/helicopter-calibrated" --fixed-video "$work/helicopter/fixed.mp4" --tradeoff
for example in lamp helicopter; do
  # From the video alone, as wide as the example is, and its period from a tripod's.
  capture=$work/$example-whole
  simulated "$example-whole" "$example"
  "$bin/lumi-pipeline" "$capture/video.mp4" -o "$work/$example-periodic" --periodic --fixed-video "$capture/fixed.mp4" --no-video --quiet
  heading "lumi-pipeline --periodic: $example"
  "$bin/timeperiodic_bench" reconstructed "$example" "$capture" "$work/$example-periodic"
done
