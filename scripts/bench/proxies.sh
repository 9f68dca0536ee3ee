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
# The mesh and a proxy of each view on photos that the mesh does not know: of few photos each in turn, else 0, 8 ...
mesh_and_views() {
  local scene=$1 fold=$2 known=judged proxy over='' seen='' coverage='' json
  [ "$fold" = each ] || known=judged-without-$fold
  # A proxy of the plain name must be there, and is not used.
  "$bin/lumi-proxy" delaunay "$scene" --name judged --quiet >/dev/null
  "$bin/lumi-proxy" delaunay "$scene" --name judged --leave-out "$fold" --quiet >/dev/null
  for proxy in "$known" per-view; do
    json=$("$bin/lumi-render" "$scene" --proxy "$proxy" --seen-proxy "$known" --holdout "$fold" --width 640 --json --quiet)
    over+=" $(json_figure "$json" psnr_mean_db) |" seen+=" $(json_figure "$json" psnr_seen_mean_db) |" coverage+=" $(json_figure "$json" coverage 3) |"
  done
  printf '| %s | %s |%s%s%s %s |\n' "${scene##*/}" "$fold" "$over" "$seen" "$coverage" "$(json_figure "$json" nearest_photo_psnr_mean_db)"
}
simulated hallway-40 hallway --views 40 --width 480
scenes=() few=()
for s in fountain desk; do if captured "$s"; then scenes+=("$work/$s"); fi; done
for s in fountain sceaux; do if captured "$s"; then few+=("$work/$s"); fi; done
heading 'A proxy of each view: milliseconds beside CGAL and OpenCV'
"$bin/view_triangulation_bench" --scene ${scenes[@]+"${scenes[@]}"}
heading 'The mesh and a proxy of each view, held out'
printf '| capture | left out | mesh dB | each view dB | mesh, seen dB | each view, seen dB | mesh coverage | each view coverage | nearest photo dB |\n|---|---|---|---|---|---|---|---|---|\n'
for s in ${few[@]+"${few[@]}"}; do mesh_and_views "$s" each; done
for s in "$work/desk" "$work/hallway-40"; do if [ -d "$s" ]; then mesh_and_views "$s" 8; fi; done
for s in ${scenes[@]+"${scenes[@]}"} "$work/hallway-40"; do block "What auto measures: ${s##*/}" "$bin/lumi-proxy" auto "$s"; done
for s in ${scenes[@]+"${scenes[@]}"}; do block "The fly-through, 960 px wide: ${s##*/}" fly_through "$s"; done
for example in car person; do block "lumi-proxy simplify --tradeoff: $example" simplified "$example"; done
