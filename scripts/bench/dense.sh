#!/usr/bin/env bash
# Dense proxies beside sparse ones, on simulated captures and on fox, fountain and sceaux below --data; depth against the truth
# Programs: lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export depth_bench bench_figures
. "${BASH_SOURCE[0]%/*}/common.sh"

# Dense proxies beside the sparse mesh: held-out photos, none of which the proxies know; pixels that two photos see over
# the dense one. Then depth against the truth.
dense_rows() {
  local scene=$1 width=$2 name=${1##*/} made json proxy over
  captured "$name" || return 0
  "$bin/lumi-proxy" delaunay "$scene" --leave-out 8 --quiet >/dev/null
  for proxy in dense dense-strict delaunay true; do
    made='' over=$proxy-without-8
    case $proxy in
      dense) made=$("$bin/lumi-proxy" dense "$scene" --width "$width" --leave-out 8 --json --quiet) ;;
      dense-strict) made=$("$bin/lumi-proxy" dense "$scene" --name dense-strict --agree 3 --width "$width" --leave-out 8 --json --quiet) ;;
      true) over=$scene/truth/mesh.ply; [ -f "$over" ] || continue ;;
    esac
    json=$("$bin/lumi-render" "$scene" -o "$work/dense-frames" --proxy "$over" --seen-proxy dense-without-8 --holdout 8 --width "$width" --json --quiet)
    rm -rf "$work/dense-frames"
    printf '| %s | %s | %s | %s | %s | %s | %s | %s |\n' "$name" "$proxy" "$(json_figure "$json" psnr_mean_db)" "$(json_figure "$json" psnr_seen_mean_db)" \
      "$(json_figure "$json" seen 3)" "$(json_figure "$json" ssim_mean 3)" "$(json_figure "$made" photos 0)" "$(json_figure "$made" seconds 1)"
  done
}
# Few photos: each left out in turn, over proxies that do not know it. (A proxy of the plain name must be there, and is not used.)
dense_each_rows() {
  local scene=$1 width=$2 kind json name=${1##*/}
  captured "$name" || return 0
  for kind in delaunay dense dense-strict; do "$bin/lumi-proxy" delaunay "$scene" --name "each-$kind" --quiet >/dev/null; done
  "$bin/lumi-proxy" delaunay "$scene" --name each-delaunay --leave-out each --quiet >/dev/null
  "$bin/lumi-proxy" dense "$scene" --name each-dense --leave-out each --width "$width" --quiet >/dev/null
  "$bin/lumi-proxy" dense "$scene" --name each-dense-strict --agree 3 --leave-out each --width "$width" --quiet >/dev/null
  for kind in delaunay dense dense-strict; do
    json=$("$bin/lumi-render" "$scene" -o "$work/dense-frames" --proxy "each-$kind" --seen-proxy each-delaunay --holdout each --width "$width" --json --quiet)
    rm -rf "$work/dense-frames"
    printf '| %s | %s | %s | %s | %s | %s | %s |\n' "${scene##*/}" "$kind" "$(json_figure "$json" psnr_mean_db 2)" "$(json_figure "$json" psnr_seen_mean_db 2)" \
      "$(json_figure "$json" seen 3)" "$(json_figure "$json" ssim_mean 3)" "$(json_figure "$json" coverage 3)"
  done
}
dense() {
  local example
  heading 'Dense proxies, held out'
  printf '| capture | proxy | all pixels dB | seen dB | seen | SSIM | photos | seconds |\n|---|---|---|---|---|---|---|---|\n'
  for example in desk plaza hallway; do
    simulated "dense-$example" "$example" --views 24 --width 640
    dense_rows "$work/dense-$example" 640
  done
  for example in fox fountain sceaux; do dense_rows "$work/$example" 800; done
  heading 'Dense proxies, each photo left out in turn'
  printf '| capture | proxy | all pixels dB | seen dB | seen | SSIM | coverage |\n|---|---|---|---|---|---|---|\n'
  for example in fountain sceaux; do dense_each_rows "$work/$example" 640; done
  heading 'Depth against the truth'
  printf '| capture | depth of | complete %% | within 1 %% | within 0.2 %% | of all within 1 %% |\n|---|---|---|---|---|---|\n'
  for example in desk plaza hallway; do
    "$bin/lumi-proxy" dense "$work/dense-$example" --depth-only --quiet >/dev/null
    "$bin/lumi-proxy" dense "$work/dense-$example" --quiet >/dev/null
    "$bin/lumi-proxy" delaunay "$work/dense-$example" --quiet >/dev/null
    "$bin/depth_bench" "$work/dense-$example" delaunay dense
  done
}
dense
