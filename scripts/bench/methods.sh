#!/usr/bin/env bash
# This renderer beside published methods on a scene or COLMAP workspace, or on all in a folder (--only methods DIR [--width W])
# Programs: lumi-export lumi-pipeline lumi-proxy lumi-reconstruct lumi-render
. "${BASH_SOURCE[0]%/*}/common.sh"

is_scene() { [ -e "$1/lumigraph.json" ] || [ -d "$1/sparse" ] || [ -e "$1/transforms.json" ]; }
# methods FOLDER [WIDTH]: itself, or all scenes in it. A workspace without proxies becomes a scene of ours first, whose proxies know no
# held-out photo; of a proxy that knows them a line says so.
methods() {
  local folder scene name results=() folders=("$1"/*/)
  if is_scene "$1"; then folders=("$1"); fi
  for folder in "${folders[@]}"; do
    folder=${folder%/} name=${folder##*/} scene=$folder
    is_scene "$folder" || continue
    if [ ! -d "$folder/proxies" ]; then
      scene=$work/methods/scenes/$name
      "$bin/lumi-pipeline" "$folder" -o "$scene" >/dev/null || { say "left out: $name"; continue; }
    fi
    "$bin/lumi-render" methods "$scene" -o "$work/methods/$name" ${2:+--width "$2"} >/dev/null || { say "left out: $name"; continue; }
    results+=("$work/methods/$name/methods.json")
  done
  [ ${#results[@]} -gt 0 ] || die "no scene in $1" 1
  printf '\n## Published methods, held out\n\n'
  "$bin/lumi-render" methods-report "${results[@]}"
}
methods "$@"
