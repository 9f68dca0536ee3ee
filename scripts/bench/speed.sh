#!/usr/bin/env bash
# What rendering costs: the optimum, sparse samples and their blends on the CPU and in OpenGL, each beside its baseline
# Programs: lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export optimum_bench sparse_blend_bench gl_blend_bench vanishing_point_bench test_render_hard_cases bench_figures
. "${BASH_SOURCE[0]%/*}/common.sh"

"$bin/optimum_bench"
"$bin/optimum_bench" --widths
heading "Weights across occluders' edges"
printf '| step, scene sizes | 1e-2 | 1e-3 | 1e-4 | 1e-5 | 1e-6 | ratios |\n|---|---|---|---|---|---|---|\n'
"$bin/test_render_hard_cases" --gtest_filter='Continuity.HoldsAcrossOcclusionEdges*' --gtest_brief=1 |
  sed -n 's/: largest change.*1e-6: /: /p' |
  awk -F '[:;] ' '{ printf "| %s |", $1; n = split($2, size, " "); for (i = 1; i <= n; i++) printf " %#.3g |", size[i]
    n = split($3, ratio, " "); for (i = 2; i <= n; i++) printf "%s %.1f", (i > 2 ? "," : ""), ratio[i]; print " |" }'
"$bin/sparse_blend_bench" time views
"$bin/gl_blend_bench"
# What a user waits for: rays, weights and blending together, along a path of ten frames.
whole_frame() {
  local what=$1 width=$2 seconds=$3 json
  shift 3
  json=$("$bin/lumi-render" "$work/desk-262" -o "$work/whole-frames" --proxy plane --width "$width" --seconds "$seconds" --threads 2 --json --quiet "$@")
  rm -rf "$work/whole-frames"
  printf '| %s | %sx%s | %s |\n' "$what" "$width" "$((width * 3 / 4))" "$(json_figure "$json" ms_per_frame 1)"
}
simulated desk-262 desk
[ -f "$work/desk-262/proxies/plane.ply" ] || "$bin/lumi-proxy" plane "$work/desk-262" --quiet >/dev/null
heading 'Whole frames: 262 photos of desk over a plane'
printf '| how | pixels | ms a frame |\n|---|---|---|\n'
whole_frame 'as by default: a weight a pixel' 1024 0.34
whole_frame 'candidates, 25x25' 1024 0.34 --grid 25x25
whole_frame 'candidates, 25x25, without prefilter' 1024 0.34 --grid 25x25 --prefilter off
whole_frame 'interpolated, 25x25, without prefilter' 1024 0.34 --grid 25x25 --sampling interpolated --prefilter off
whole_frame 'optimum, 25x25' 640 0.34 --grid 25x25 --similarity full
whole_frame 'optimum, a weight a pixel' 640 0.07 --similarity full
"$bin/sparse_blend_bench" psnr --scene "$work/desk-262" --proxy plane --title 'desk, plane, foreground'
"$bin/sparse_blend_bench" psnr --scene "$work/desk-262" --proxy truth --title 'desk, true mesh, foreground'
block 'Fig. 6-3: angles by vanishing points against true ones' "$bin/vanishing_point_bench" "$work/desk-262" --proxy plane -o "$work/figure-6-3"
if captured fox; then
  for proxy in plane delaunay; do "$bin/sparse_blend_bench" psnr --scene "$work/fox" --proxy "$proxy" --title "fox, $proxy"; done
fi
if knights_scene; then
  "$bin/sparse_blend_bench" psnr --scene "$work/knights" --proxy plane --title 'knights, plane'
  block 'Held out: knights' "$bin/lumi-render" "$work/knights" --holdout 8
fi
block 'The nine properties of Table 3.2: desk, plane' "$bin/lumi-render" properties "$work/desk-262" --proxy plane
