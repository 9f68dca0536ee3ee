#!/usr/bin/env bash
# Several videos at once, and scenes that carry times: what is shown of a moment, and what times cost
# Programs: lumi-simulate lumi-reconstruct lumi-proxy lumi-render lumi-export time_scenes_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

# Two of its three seconds.
simulated stage stage --width 240 --fixed-frames 60
heading 'Several videos at once: stage, which begins at 9, 0, 14, 3, 21, 7, 12, 5'
rm -rf "$work/stage-scene"
printf '```\n'
"$bin/lumi-reconstruct" "$work/stage/videos" -o "$work/stage-scene" 2>&1 | grep 'start at frames'
printf '```\n'
simulated lamp lamp --width 240
"$bin/time_scenes_bench" "$work" ${data:+"$data"}
