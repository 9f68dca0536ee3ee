#!/usr/bin/env bash
# Time-periodic scenes at unseen places and phases: error against the distance to the nearest photo and the time window's width
# Programs: lumi-simulate lumi-render timeperiodic_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

# PSNR (dB) over the pixels where something moves at any time, over the simulation's own cameras and billboard: five views and phases a row, the nearest
# photo's camera in world units and as a share of the cameras' extent, windows in frames.
for example in lamp helicopter; do
  simulated "$example-unseen" "$example" --width 240 --fixed-frames 2
  heading "Unseen views of a time-periodic scene: $example"
  "$bin/timeperiodic_bench" unseen "$example" "$work/$example-unseen"
done
