#!/usr/bin/env bash
# A street of 5,000 photos of two megapixels within 2 GB: memory, photos read, milliseconds; lumi-view where there is an X server or Xvfb
# Programs: lumi-simulate lumi-render lumi-view
. "${BASH_SOURCE[0]%/*}/common.sh"

# A straight path down the street: FILE FROM_Y TO_Y SECONDS.
street_path() {
  local key='"cam_from_world_xyzw": [0.70710678, 0, 0, 0.70710678], "vertical_fov_deg": 50'
  printf '{"format": "lumigraph-path", "version": 1, "fps": 30, "width": 960, "height": 540, "keys": [{"time_s": 0, "position": [1, %s, 1.7], %s}, {"time_s": %s, "position": [1, %s, 1.7], %s}]}\n' \
    "$2" "$key" "$4" "$3" "$key" >"$1"
}
row() { printf '| `%s` | %s | %s | %s | %s | %s | %s |\n' "$@"; }
# rendered SCENE NAME PATH OPTIONS...: a row of the table.
rendered() {
  local scene=$1 name=$2 path=$3 json program=lumi-render
  shift 3
  rm -rf "$work/large-$name"
  json=$(peak_mb "$work/large-mb" "$bin/lumi-render" "$scene" -o "$work/large-$name" --path "$path" --grid 25x25 --effects fov,visibility,prefilter "$@" --json --quiet)
  [[ " $* " != *" gl "* ]] || program+=' --backend gl'
  row "$program" "$name" "$(cat "$work/large-mb")" "$(json_figure "$json" read 0)" "$(json_figure "$json" ms_per_frame 0)" "$(json_figure "$json" slowest_ms 0)" "$(json_figure "$json" first_ms 0)"
}
# seen SCENE NAME PATH: the same in the viewer.
seen() {
  local json screen=()
  [ -n "${DISPLAY:-}" ] || screen=(xvfb-run -a -s '-screen 0 1280x800x24')
  json=$(peak_mb "$work/large-mb" "${screen[@]}" "$bin/lumi-view" "$1" --no-ui --width 960 --height 540 --grid 25x25 --effects fov,visibility,prefilter --script "path-load $3; wait; play" --json --quiet)
  row lumi-view "$2, played" "$(cat "$work/large-mb")" - "$(json_figure "$json" median_frame_ms 0)" "$(json_figure "$json" slowest_frame_ms 0)" "$(awk -v s="$(json_figure "$json" seconds_to_open)" 'BEGIN { printf "%.0f", 1000 * s }')"
}
large() {
  local scene=$work/street
  simulated street street
  street_path "$work/street-walk.json" 480 504 10
  street_path "$work/street-whole.json" 8 998 20
  "$bin/lumi-render" "$scene" -o "$work/large-first" --view 2500 --width 64 --memory-mb 2048 --quiet >/dev/null  # the small copies are made
  heading 'A street of 5,000 photos within 2 GB'
  printf 'Photos of 1632x1224; pictures of 960x540 down the street, the true proxy, `--grid 25x25 --effects fov,visibility,prefilter --memory-mb 2048`, which is the default of `lumi-view`.\n'
  printf 'The walk: 24 m in 10 s, 30 frames a second. First: ms of the first picture; of `lumi-view`: from its start to the first picture of photos.\n\n'
  printf '| | path | peak MB | photos read | ms a frame, median | slowest | first |\n|---|---|---|---|---|---|---|\n'
  rendered "$scene" walk "$work/street-walk.json" --memory-mb 2048
  rendered "$scene" whole-street "$work/street-whole.json" --memory-mb 2048
  rendered "$scene" walk "$work/street-walk.json" --memory-mb 2048 --backend gl
  if [ -n "${DISPLAY:-}" ] || command -v xvfb-run >/dev/null; then
    seen "$scene" walk "$work/street-walk.json"
    seen "$scene" whole-street "$work/street-whole.json"
  fi
  rm -rf "$work"/large-walk "$work"/large-whole-street "$work"/large-first "$work"/large-mb
}
large
