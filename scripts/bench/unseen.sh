#!/usr/bin/env bash
# A time-periodic scene at unseen places and phases: error against the distance to the nearest photo and the time window's width
# Programs: lumi-simulate lumi-render timeperiodic_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

# PSNR (dB) over the pixels where something moves at any time, over the simulation's own cameras and billboard: five views and phases a row, the nearest
# photo's camera in world units and as a share of the cameras' extent, windows in frames.
simulated lamp-unseen lamp --width 240 --fixed-frames 2
heading 'Unseen views of a time-periodic scene: lamp'
"$bin/timeperiodic_bench" unseen lamp "$work/lamp-unseen"
