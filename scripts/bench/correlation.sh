#!/usr/bin/env bash
# The optimum, held out: falling leaves against correlation measured from the photos, and its ways of summing and combining
# Programs: lumi-simulate lumi-proxy lumi-render lumi-pipeline lumi-reconstruct lumi-export bench_figures
. "${BASH_SOURCE[0]%/*}/common.sh"

geometry=scripts/thesis-figures
for example in desk plaza hallway; do simulated "$example-60" "$example" --views 60 --width 320; done
simulated car car
{
  "$bin/lumi-proxy" plane "$work/desk-60" --quiet
  "$bin/lumi-proxy" import "$geometry/hallway.obj" "$work/hallway-60" --name tube --quiet
  "$bin/lumi-proxy" import "$geometry/plaza.obj" "$work/plaza-60" --name planes --quiet
  "$bin/lumi-proxy" hull "$work/car" --silhouettes "$work/car/truth/silhouettes" --quiet
} >/dev/null
rows=("desk-60 truth/mesh.ply" "desk-60 plane" "hallway-60 tube" "plaza-60 planes" "car hull")
# Real ones over the proxy that was chosen for them.
for capture in fox fountain sceaux; do if captured "$capture"; then rows+=("$capture "); fi; done
# Not knights: all 289 photos of that light field correlate, and a ray takes a fifth of a second.

# judged SCENE PROXY OPTIONS...: sets db, PSNR over seen pixels; ms, milliseconds a frame; and label, the proxy's name.
judged() {
  local scene=$1 over=() json
  case $2 in
    '') ;;
    truth/*) over=(--proxy "$scene/$2") ;;
    *) over=(--proxy "$2") ;;
  esac
  shift 2
  json=$("$bin/lumi-render" "$scene" ${over[@]+"${over[@]}"} --holdout 8 --width 160 "$@" --json --quiet)
  db=$(json_figure "$json" psnr_seen_mean_db) ms=$(json_figure "$json" ms_per_frame 0) label=$(json_text "$json" proxy)
  case $label in */truth/mesh.ply) label='true mesh' ;; esac
}
optimum=(--similarity full) measured=(--similarity full --correlation measured --cutoff-deg 40)
heading 'Correlation as the data have it, held out'
printf 'PSNR over seen pixels, dB, 160 pixels wide, photos 0, 8 ...; milliseconds a frame.\n\n'
printf '| capture | proxy | `1/h`, k 4 | `1/h`, k 8 | leaves | measured | 4 regions | ms: k 4 | leaves | measured | 4 regions |\n|---|---|---|---|---|---|---|---|---|---|---|\n'
for row in "${rows[@]}"; do
  capture=${row%% *} over=${row#* } figures='' times=''
  for way in 4 8 leaves measured regions; do
    case $way in
      4 | 8) judged "$work/$capture" "$over" --k "$way" ;;
      leaves) judged "$work/$capture" "$over" "${optimum[@]}" ;;
      measured) judged "$work/$capture" "$over" "${measured[@]}" ;;
      regions) judged "$work/$capture" "$over" "${measured[@]}" --correlation-regions 4 ;;
    esac
    figures+=" $db |"
    [ "$way" = 8 ] || times+=" $ms |"
  done
  printf '| %s | %s |%s%s\n' "$capture" "$label" "$figures" "$times"
done

heading 'Ways of the optimum, held out'
printf 'The same; `constrained` with `--cutoff-deg 180`.\n\n'
printf '| capture | proxy | `--sum local-mean` | renormalise | constrained | `--combine additive` |\n|---|---|---|---|---|---|\n'
for row in "${rows[@]}"; do
  capture=${row%% *} over=${row#* } figures=''
  for way in '--sum local-mean' '--sum renormalise' '--sum constrained --cutoff-deg 180' '--combine additive'; do
    # shellcheck disable=SC2086
    judged "$work/$capture" "$over" "${optimum[@]}" $way
    figures+=" $db |"
  done
  printf '| %s | %s |%s\n' "$capture" "$label" "$figures"
done
