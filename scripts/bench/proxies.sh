#!/usr/bin/env bash
# Proxies: alignment by ICP, triangulation of each view, what auto measures, fewer faces
# Programs: lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export view_triangulation_bench bench_figures
. "${BASH_SOURCE[0]%/*}/common.sh"

# Faces against error against time, as lumi-proxy prints it.
simplified() {
  [ -d "$work/$1/proxies" ] && [ -f "$work/$1/proxies/hull.ply" ] || {
    simulated "$1" "$1" && cp -r "$work/$1/truth/silhouettes" "$work/$1/silhouettes" && "$bin/lumi-proxy" hull "$work/$1"
  } >/dev/null
  "$bin/lumi-proxy" simplify "$work/$1" --from hull --tradeoff
}
simulated desk-capture desk --views 24 --width 640
for scale in 0.8 1.05 1.2 1.3; do
  block "A mesh at $scale times its size, aligned by ICP" "$bin/lumi-proxy" import "$work/desk-capture/truth/mesh.ply" "$work/desk-capture" --name by-icp --scale "$scale" --align icp
done
scenes=()
for s in fountain desk; do if captured "$s"; then scenes+=("$work/$s"); fi; done
block 'A proxy of each view: milliseconds beside CGAL and OpenCV' "$bin/view_triangulation_bench" --scene ${scenes[@]+"${scenes[@]}"}
for s in ${scenes[@]+"${scenes[@]}"}; do
  block "What auto measures: ${s##*/}" "$bin/lumi-proxy" auto "$s"
  block "The fly-through, 960 px wide: ${s##*/}" fly_through "$s"
  for proxy in delaunay per-view; do block "Held out: ${s##*/}, $proxy, 640 px wide" "$bin/lumi-render" "$s" --proxy "$proxy" --holdout 8 --width 640; done
done
for example in car person; do block "lumi-proxy simplify --tradeoff: $example" simplified "$example"; done
