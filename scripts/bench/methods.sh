#!/usr/bin/env bash
# This renderer beside published methods on every scene or COLMAP workspace below a folder (--only methods DIR)
# Programs: lumi-export lumi-pipeline lumi-proxy lumi-reconstruct lumi-render
. "${BASH_SOURCE[0]%/*}/common.sh"

# methods FOLDER: all scenes in it. A workspace without proxies becomes a scene of ours first, whose proxies know no held-out photo.
methods() {
  local folder scene name results=()
  for folder in "$1"/*/; do
    folder=${folder%/} name=${folder##*/} scene=$folder
    [ -e "$folder/lumigraph.json" ] || [ -d "$folder/sparse" ] || [ -e "$folder/transforms.json" ] || continue
    if [ ! -d "$folder/proxies" ]; then
      scene=$work/methods/scenes/$name
      "$bin/lumi-pipeline" "$folder" -o "$scene" >/dev/null || { say "left out: $name"; continue; }
    fi
    "$bin/lumi-render" methods "$scene" -o "$work/methods/$name" --quiet || { say "left out: $name"; continue; }
    results+=("$work/methods/$name/methods.json")
  done
  [ ${#results[@]} -gt 0 ] || die "no scene in $1" 1
  printf '\n## Published methods, held out\n\n'
  "$bin/lumi-render" methods-report "${results[@]}"
}
methods "$1"
