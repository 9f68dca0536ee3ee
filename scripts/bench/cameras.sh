#!/usr/bin/env bash
# Cameras by our features beside COLMAP's: seconds a step, photos placed, errors; also of dinosaur below --data
# Programs: lumi-simulate lumi-reconstruct cameras_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

printf '\n## Cameras by our features and by those of COLMAP\n\n'
"$bin/cameras_bench" --work "$work" ${data:+--data "$data"}
