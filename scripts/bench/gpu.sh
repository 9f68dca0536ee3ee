#!/usr/bin/env bash
# Frames of 3840x2160 on a graphics processor, beside the least that blending costs there; the viewer's, where there is a display
# Programs: lumi-simulate lumi-render lumi-view gl_blend_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

device=$("$bin/gl_blend_bench" device)
case $device in llvmpipe* | softpipe* | SwiftShader*) die "OpenGL draws on the processor here ($device): this part is for a graphics processor" ;; esac
"$bin/gl_blend_bench" frames 3840x2160
simulated desk-262-wide desk --width 1920
heading 'Pictures of 3840x2160: 262 photos of desk over its true mesh'
printf 'Photos of 1920x1440, visibility by the mesh. A picture: planning, weights, blending, and reading it back.\n\n'
printf '| how | where | pictures | ms a picture, median | slowest after the first | all, from opening the scene to the last PNG file, s |\n|---|---|---|---|---|---|\n'
path() {
  local what=$1 backend=$2 json begin end
  shift 2
  begin=$(date +%s%N)
  json=$("$bin/lumi-render" "$work/desk-262-wide" -o "$work/gpu-frames" --proxy truth --width 3840 --height 2160 --backend "$backend" --json --quiet "$@")
  end=$(date +%s%N)
  rm -rf "$work/gpu-frames"
  printf '| %s | %s | %s | %s | %s | %s |\n' "$what" "$(json_text "$json" device)" "$(json_figure "$json" frames 0)" \
    "$(json_figure "$json" ms_per_frame 1)" "$(json_figure "$json" slowest_ms 1)" "$(awk -v ns=$((end - begin)) 'BEGIN { printf "%.1f", ns / 1e9 }')"
}
path 'as by default: a weight a pixel' gl --seconds 2
path 'candidates, 25x25' gl --seconds 2 --grid 25x25
path 'optimum on samples, 25x25' gl --seconds 0.5 --grid 25x25 --sampling interpolated --similarity full
path 'as by default: a weight a pixel' cpu --seconds 0.2
path 'candidates, 25x25' cpu --seconds 0.5 --grid 25x25
# Its window needs a display with a graphics processor behind it; under xvfb-run, OpenGL draws on the processor, and elsewhere no window may open.
window=''
[ -z "${DISPLAY:-}" ] || window=$(json_text "$("$bin/lumi-view" "$work/desk-262-wide" --no-ui --json --quiet --script 'wait 0.1' || true)" device || true)
if [ -n "$window" ] && [[ $window != llvmpipe* && $window != softpipe* && $window != SwiftShader* ]]; then
  heading 'The viewer in a window of 3840x2160: 262 photos of desk over its true mesh'
  printf '| how | device | frames | ms a frame, median | one in a hundred takes | slowest |\n|---|---|---|---|---|---|\n'
  viewed() {
    local what=$1 json
    shift
    json=$("$bin/lumi-view" "$work/desk-262-wide" --proxy truth --width 3840 --height 2160 --memory-mb 16384 --no-ui --json \
      --script 'jump 0; key-add; jump 40; key-add; jump 90; key-add; wait; play' "$@" --quiet)
    printf '| %s | %s | %s | %s | %s | %s |\n' "$what" "$(json_text "$json" device)" "$(json_figure "$json" frames 0)" \
      "$(json_figure "$json" median_frame_ms)" "$(json_figure "$json" frame_ms_99)" "$(json_figure "$json" slowest_frame_ms 1)"
  }
  viewed 'as by default: a weight a pixel'
  viewed 'candidates, 25x25' --grid 25x25
fi
