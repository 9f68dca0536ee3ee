#!/usr/bin/env bash
# The period finder on simulated and painted videos: how often it is right, and whether it knows its own error
# Programs: period_bench timeperiodic_bench lumi-simulate lumi-timeperiodic
. "${BASH_SOURCE[0]%/*}/common.sh"

for example in lamp helicopter; do simulated "$example" "$example" --width 240; done
heading 'Time-periodic scenes: periods'
"$bin/timeperiodic_bench" "$work" ${data:+"$data"}
heading 'The period finder on videos that it was not tuned on'
"$bin/period_bench" 24
