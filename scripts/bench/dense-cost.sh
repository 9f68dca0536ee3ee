#!/usr/bin/env bash
# What dense proxies take: seconds, memory, milliseconds a frame, the fly-through
# Programs: lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export bench_figures
. "${BASH_SOURCE[0]%/*}/common.sh"

dense_costs() {
  simulated dense-desk desk --views 24 --width 640
  [ -f "$work/dense-desk/proxies/delaunay.ply" ] || "$bin/lumi-proxy" delaunay "$work/dense-desk" --quiet >/dev/null
  [ -f "$work/dense-desk/proxies/dense.ply" ] || "$bin/lumi-proxy" dense "$work/dense-desk" --quiet >/dev/null
  heading 'What dense proxies take'
  printf '| capture | depth maps px | points merged within px | seconds a photo | their peak MB | points | mesh s | fewer faces s | whole command, peak MB |\n|---|---|---|---|---|---|---|---|---|\n'
  dense_cost "$work/dense-desk" 640 1.5
  dense_cost "$work/dense-desk" 640 1
  dense_cost "$work/fountain" 1000 1
  heading 'Milliseconds a frame over dense proxies'
  printf '| capture | drawn | sparse mesh ms | dense mesh ms | ratio | all of its faces ms |\n|---|---|---|---|---|---|\n'
  dense_frames "$work/dense-desk"
}
# What depth and meshing take: SCENE WIDTH MERGE_PX, everything anew; depth maps once more by themselves, for their own peak.
dense_cost() {
  local made folder
  captured "${1##*/}" || return 0
  folder=$(mktemp -d)
  peak_mb "$folder/depth_mb" "$bin/lumi-proxy" dense "$1" --width "$2" --depth-only -o "$folder/stereo" --quiet >/dev/null
  made=$(peak_mb "$folder/mb" "$bin/lumi-proxy" dense "$1" --width "$2" --merge-px "$3" -o "$folder/dense.ply" --json --quiet)
  awk -v name="${1##*/}" -v width="$2" -v merge="$3" -v depth_mb="$(cat "$folder/depth_mb")" -v mb="$(cat "$folder/mb")" '
    /"(photos|points_used|tetrahedra|lines_of_sight|cut|surface|simplify_seconds)":/ { gsub(/[",]/, ""); sub(":", ""); value[$1] = $2 }
    /"seconds":/ && !depth { gsub(/,/, ""); depth = $2 }
    END {
      printf "| %s | %d | %s | %.1f | %s | %d | %.1f | %.1f | %s |\n", name, width, merge, depth / value["photos"], depth_mb, value["points_used"],
        value["tetrahedra"] + value["lines_of_sight"] + value["cut"] + value["surface"], value["simplify_seconds"], mb
    }' <<<"$(sed -n '/"depth"/,$p' <<<"$made")"
  rm -rf "$folder"
}
# Milliseconds a frame along a path over the sparse mesh, over the dense one as it is left and over all of its faces: the median of its
# frames, the least of three runs in turns.
dense_frames() {
  local scene=$1 backend grid proxy round ms json
  local -A least
  "$bin/lumi-proxy" dense "$scene" --faces 0 --name dense-all --quiet >/dev/null
  for backend in cpu gl; do
    for grid in pixel 25x25; do
      least=()
      for round in 1 2 3; do
        for proxy in delaunay dense dense-all; do
          json=$("$bin/lumi-render" "$scene" -o "$work/dense-frames" --proxy "$proxy" --backend "$backend" --grid "$grid" --seconds 1 --width 640 --json --quiet)
          rm -rf "$work/dense-frames"
          ms=$(grep -o '"ms_per_frame": *[0-9.]*' <<<"$json" | grep -o '[0-9.]*$')
          least[$proxy]=$(awk -v a="${least[$proxy]:-1e9}" -v b="$ms" 'BEGIN { print a < b ? a : b }')
        done
      done
      awk -v name="${scene##*/}" -v how="$backend, $grid" -v m="${least[delaunay]}" -v d="${least[dense]}" -v a="${least[dense-all]}" \
        'BEGIN { printf "| %s | %s | %.1f | %.1f | %.2f | %.1f |\n", name, how, m, d, d / m, a }'
    done
  done
}
dense_costs
block 'The fly-through, 960 px wide: dense-desk' fly_through "$work/dense-desk" dense
