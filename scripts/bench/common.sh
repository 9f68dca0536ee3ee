# shellcheck shell=bash
# What the parts of bench.sh share: sourced by each of them. bench.sh starts a part in the project's root with
#   LUMI_BENCH_WORK   where scenes are kept from one run to the next
#   LUMI_BENCH_DATA   the folder of captures, or nothing
#   LUMI_BENCH_UPDATE 1: files beside the pages are written as well
# A part prints Markdown: headings, tables, code blocks. What it prints may be quoted in docs by its heading.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
. scripts/common.sh
bin=build/release/bin work=${LUMI_BENCH_WORK:-build/bench} data=${LUMI_BENCH_DATA:-}
mkdir -p "$work"

heading() { printf '\n## %s\n\n' "$1"; }
# block TITLE COMMAND...: as it prints.
block() {
  heading "$1"
  shift
  printf '```\n'
  "$@"
  printf '```\n'
}
# json_figure TEXT KEY [DECIMALS]: the first number of that name.
json_figure() {
  grep -o "\"$2\": *-\{0,1\}[0-9.]*" <<<"$1" | head -n 1 | grep -o -- '-\{0,1\}[0-9.]*$' | awk -v decimals="${3:-2}" '{ printf "%.*f", decimals, $1 }'
}
# json_text TEXT KEY: the first text of that name.
json_text() { grep -o "\"$2\": *\"[^\"]*\"" <<<"$1" | head -n 1 | cut -d'"' -f4; }
# simulated NAME EXAMPLE OPTIONS...: a capture in $work/NAME, made where it is missing.
simulated() {
  local name=$1 example=$2
  shift 2
  [ -d "$work/$name/truth" ] || "$bin/lumi-simulate" --example "$example" "$@" -o "$work/$name" --quiet >/dev/null
}
# captured NAME: whether $work has a scene of it, made from the captures below --data where it is missing.
captured() {
  [ -f "$work/$1/lumigraph.json" ] && return 0
  { [ "$1" = desk ] || [ -d "${data:-/nowhere}/$1" ]; } || return 1
  # Callers ask with `if` or `||`, where a failure would count as "there is none".
  "$bin/bench_figures" --work "$work" ${data:+--data "$data"} --only "$1" --quiet >/dev/null || die "$1 could not be made" 1
}
# knights_scene: whether $work has it: a rectified camera grid, places from the files' names, a focal length that nothing tells; over a plane.
knights_scene() {
  [ -n "$data" ] && [ -d "$data/knights" ] || return 1
  [ -f "$work/knights/lumigraph.json" ] || "$bin/lumi-reconstruct" "$data/knights/images" -o "$work/knights" --rig grid --quiet >/dev/null || die "knights could not be made" 1
  [ -f "$work/knights/proxies/plane.ply" ] || "$bin/lumi-proxy" auto "$work/knights" --proxy-minutes 0 --quiet >/dev/null || die "knights could not be made" 1
}
# peak_mb FILE COMMAND...: runs it, and leaves its largest resident size in FILE, in megabytes; "-" without Debian's package `time`.
peak_mb() {
  local file=$1
  shift
  if [ ! -x /usr/bin/time ]; then
    echo - >"$file"
    "$@"
  else
    /usr/bin/time -f %M -o "$file.kb" "$@"
    awk '{ printf "%d", $1 / 1024 }' "$file.kb" >"$file"
  fi
}
# The pipeline's fly-through beside a weight at every pixel: ms a frame, and dB between the frames before they are compressed.
fly_through() {
  local scene=$1 way json folder=$work/fly-through-${1##*/} over=()
  [ -z "${2:-}" ] || over=(--proxy "$2")
  for way in pixel sparse; do
    [ "$way" = pixel ] && options=() || options=(--fidelity-db 40)
    rm -rf "$folder-$way"
    json=$("$bin/lumi-render" "$scene" -o "$folder-$way" --width 960 --seconds 6 "${over[@]}" "${options[@]}" --json --quiet)
    printf '%-7s %s ms a frame%s\n' "$way" "$(grep -o '"ms_per_frame": *[0-9.]*' <<<"$json" | grep -o '[0-9.]*$' | cut -c1-5)" \
      "$(grep -o '"name": *"[a-z]* [0-9]*x[0-9]*, k [0-9]*"' <<<"$json" | head -n 1 | cut -d'"' -f4 | sed 's/^/  /')"
  done
  # Over black, as the video has them.
  over_black='format=gbrap,premultiply=inplace=1,format=gbrp'
  ffmpeg -nostdin -hide_banner -i "$folder-sparse/frames/frame_%06d.png" -i "$folder-pixel/frames/frame_%06d.png" \
    -filter_complex "[0]$over_black[a];[1]$over_black[b];[a][b]psnr" -f null - 2>&1 | sed -n 's/.*average:\([^ ]*\) min:\([^ ]*\).*/PSNR between them \1 dB over all frames, \2 dB at the worst/p'
  rm -rf "$folder-pixel" "$folder-sparse"
}
