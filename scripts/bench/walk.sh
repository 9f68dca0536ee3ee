#!/usr/bin/env bash
# Cameras of a simulated walk in shuffled order: 50, 100 and 200 photos; --photos N others
# Programs: lumi-simulate lumi-reconstruct walk_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

heading 'Cameras of a walk in shuffled order'
"$bin/walk_bench" --work "$work" --photos "${1:-50,100,200}"
