#!/usr/bin/env bash
# Held-out errors, poses and reproduction of a simulated desk (24 photos) and of fountain, sceaux and fox below --data
# Programs: bench_figures
. "${BASH_SOURCE[0]%/*}/common.sh"

"$bin/bench_figures" --work "$work" ${data:+--data "$data"} "$@"
