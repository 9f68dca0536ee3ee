#!/usr/bin/env bash
# Visual hulls: volumes, detail against time; a turntable by one command from dinosaur below --data
# Programs: lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-simulate lumi-export hull_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

printf '\n## Visual hulls: volume over the body'"'"'s own\n\n'
"$bin/hull_bench" volumes
if [ -n "$data" ] && [ -d "$data/dinosaur" ]; then
  printf '\n## Visual hulls of captures (2 threads)\n\n'
  "$bin/hull_bench" captures "$data"
  printf '\n## Detail against time: dinosaur (2 threads)\n\n'
  "$bin/hull_bench" detail "$data"
fi
if [ -n "$data" ] && [ -d "$data/dinosaur" ]; then
  # From photos, cameras and a rule on colours to a lumigraph over 500 faces, by one command; beside it a plane.
  "$bin/lumi-pipeline" "$data/dinosaur/images" -o "$work/dinosaur" --poses "$data/dinosaur/dino_P.txt" --poses-format projection \
    --silhouette-rule '(B - R) < 25 && R + G + B > 60' --proxy hull --faces 500 --no-video --quiet
  "$bin/lumi-proxy" plane "$work/dinosaur" --quiet
  printf '\n## Held out: dinosaur, by its proxies\n\n```\n'
  for proxy in hull hull-500 plane; do
    printf '%s\n' "$proxy"
    "$bin/lumi-render" "$work/dinosaur" --proxy "$proxy" --holdout 8 2>/dev/null | grep -E '^(held-out photo|mean)'
  done
  printf '```\n'
fi
for example in person car; do
  simulated "$example" "$example"
  printf '\n## lumi-proxy hull: %s (2 threads)\n\n```\n' "$example"
  "$bin/lumi-proxy" hull "$work/$example" --silhouettes "$work/$example/truth/silhouettes" -o "$work/$example-hull.ply" --threads 2
  printf '```\n'
done
printf '\n## lumi-proxy hull --tradeoff: car (2 threads)\n\n```\n'
"$bin/lumi-proxy" hull "$work/car" --silhouettes "$work/car/truth/silhouettes" --tradeoff --threads 2
printf '```\n'
