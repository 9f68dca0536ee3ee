#!/usr/bin/env bash
# A street of 50, 500 and 5,000 photos, equally dense: opening it, memory, a frame
# Programs: lumi-simulate lumi-render
. "${BASH_SOURCE[0]%/*}/common.sh"

# street_part METRES: the street's first metres, as densely photographed as the whole: a photo to either side every 0.4 m.
street_part() {
  local name=street-$1 metres=$1
  [ -d "$work/$name/truth" ] && return
  sed "s/\"views\": 2500/\"views\": $((metres * 5 / 2))/; s/1006/$((metres + 6))/g" simulate/examples/street.json >"$work/$name.json"
  "$bin/lumi-simulate" "$work/$name.json" --width 240 -o "$work/$name" --quiet >/dev/null
}
# seconds COMMAND...: how long it took.
seconds() {
  local begin
  begin=$(date +%s.%N)
  "$@" >/dev/null
  awk -v a="$begin" -v b="$(date +%s.%N)" 'BEGIN { printf "%.1f", b - a }'
}
streets() {
  local metres scene round json ms least opening
  heading 'A street of 50, 500 and 5,000 photos'
  cat <<'TEXT'
Photos 240 px wide, a photo to either side every 0.4 m, held in memory; the true proxy. Opening: one picture with `--effects none`, from start to end. A
frame: 960x720 pixels, `--grid 25x25 --effects fov,visibility`, the least of three runs. Both at the camera of `street_0012.jpg`.

TEXT
  printf '| metres | photos | opening s | its peak MB | a frame ms | bytes a photo: lumigraph.json | sparse/ |\n|---|---|---|---|---|---|---|\n'
  for metres in 10 100 1000; do
    scene=$work/street-$metres
    street_part "$metres"
    local at=("$scene" -o "$work/street-frame" --view street_0012.jpg --width 960 --grid 25x25 --quiet)
    rm -rf "$work/street-frame"
    opening=$(seconds peak_mb "$work/street-mb" "$bin/lumi-render" "${at[@]}" --effects none)
    least=1e9
    for round in 1 2 3; do
      rm -rf "$work/street-frame"
      json=$("$bin/lumi-render" "${at[@]}" --effects fov,visibility --json)
      ms=$(json_figure "$json" ms_per_frame)
      least=$(awk -v a="$least" -v b="$ms" 'BEGIN { print a < b ? a : b }')
    done
    printf '| %d | %d | %s | %s | %.1f | %d | %d |\n' "$metres" $((metres * 5)) "$opening" "$(cat "$work/street-mb")" "$least" \
      $(($(stat -c %s "$scene/lumigraph.json") / metres / 5)) $(($(du -sb "$scene/sparse" | cut -f1) / metres / 5))
  done
  rm -rf "$work/street-frame" "$work/street-mb"
}
streets
