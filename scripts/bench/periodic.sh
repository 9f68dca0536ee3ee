#!/usr/bin/env bash
# Several videos at once, scenes that carry times, time-periodic scenes and their --tradeoffs
# Programs: lumi-export lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-simulate lumi-timeperiodic time_scenes_bench timeperiodic_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

for example in lamp helicopter; do simulated "$example" "$example" --width 240; done
# Two of its three seconds.
simulated stage stage --width 240 --fixed-frames 60
printf '\n## Several videos at once: stage, which begins at 9, 0, 14, 3, 21, 7, 12, 5\n\n```\n'
rm -rf "$work/stage-scene"
"$bin/lumi-reconstruct" "$work/stage/videos" -o "$work/stage-scene" 2>&1 | grep 'start at frames'
printf '```\n\n## Scenes that carry times\n\n'
"$bin/time_scenes_bench" "$work" ${data:+"$data"}
for example in 'lamp 150.37' 'helicopter 15.37'; do
  printf '\n## lumi-timeperiodic period --tradeoff: %s\n\n```\n' "${example% *}"
  "$bin/lumi-timeperiodic" period "$work/${example% *}/fixed.mp4" --true-period "${example#* }" --tradeoff "$work/${example% *}-period"
  printf '```\n'
done
printf '\n## lumi-timeperiodic calibrate --tradeoff: helicopter\n\n```\n'
"$bin/lumi-timeperiodic" calibrate "$work/helicopter/video.mp4" -o "$work/helicopter-calibrated" --fixed-video "$work/helicopter/fixed.mp4" --tradeoff
printf '```\n'
for example in lamp helicopter; do
  # From the video alone, as wide as the example is, and its period from a tripod's.
  capture=$work/$example-whole
  simulated "$example-whole" "$example"
  "$bin/lumi-pipeline" "$capture/video.mp4" -o "$work/$example-periodic" --periodic --fixed-video "$capture/fixed.mp4" --no-video --quiet
  printf '\n## lumi-pipeline --periodic: %s\n\n' "$example"
  "$bin/timeperiodic_bench" reconstructed "$example" "$capture" "$work/$example-periodic"
done
