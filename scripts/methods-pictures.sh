#!/usr/bin/env bash
# The pictures of docs/methods.md and docs/benchmark.md: one view by each method, in colours and in false colours (a colour a photo), and a photo's
# own camera in false colours.
#
#   scripts/methods-pictures.sh SCENE OUT     e.g. lumi-simulate --example desk --views 60 --width 320 -o SCENE
#     --proxy NAME  --view NAME  of a photo, which the view is rendered without; default: the middle one
#     --bin DIR     programs that are built already; default: build/release/bin
# OUT/methods.jpg, OUT/methods-false-color.jpg, OUT/methods-own-camera.jpg: rows of five, this renderer first, the others by year.
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/common.sh

bin=build/release/bin over=() view='' folders=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,9s/^# \{0,1\}//p' scripts/methods-pictures.sh; exit 0 ;;
    --proxy | --view | --bin)
      [ $# -ge 2 ] || die "$1 needs a value" 2
      case $1 in --proxy) over=(--proxy "$2") ;; --view) view=$2 ;; --bin) case $2 in /*) bin=$2 ;; *) bin=$start_folder/$2 ;; esac ;; esac
      shift 2 ;;
    -*) die "$1 is no option (see --help)" 2 ;;
    *) case $1 in /*) folders+=("$1") ;; *) folders+=("$start_folder/$1") ;; esac; shift ;;
  esac
done
[ ${#folders[@]} -eq 2 ] || die "SCENE and OUT are wanted (see --help)" 2
scene=${folders[0]} out=${folders[1]}
methods=(ulr chen-williams-1993 levoy-hanrahan-1996 gortler-1996 debevec-1996 seitz-dyer-1996 pulli-1997 debevec-1998 pighin-1998 heigl-1999
  lhuillier-quan-1999 wood-2000 sibr-ulr)
if [ -z "$view" ]; then
  photos=("$scene"/images/*)
  view=$(basename "${photos[$((${#photos[@]} / 2))]}")
fi
mkdir -p "$out"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# mosaic NAME OPTIONS...: a picture that a method refuses is left grey.
mosaic() {
  local name=$1 tiles=() method
  shift
  for method in "${methods[@]}"; do
    rm -rf "$work/one"
    if "$bin/lumi-render" "$scene" "${over[@]}" --view "$view" --width 240 --method "$method" "$@" -o "$work/one" --quiet >/dev/null 2>&1; then
      tiles+=("$work/$name-$method.png")
      find "$work/one" -name '*.png' | head -n 1 | while read -r file; do mv "$file" "$work/$name-$method.png"; done
    else
      say "$method does not take $view"
      cp "${tiles[0]}" "$work/$name-$method.png"
      oiiotool "$work/$name-$method.png" --mulc 0 --addc 0.5 -o "$work/$name-$method.png"
      tiles+=("$work/$name-$method.png")
    fi
  done
  oiiotool "${tiles[@]}" --mosaic:pad=4 5x3 --ch R,G,B -o "$work/$name.png"
  jpeg_for_docs "$work/$name.png" 3 "$out/$name.jpg"
}
mosaic methods --leave-out
mosaic methods-false-color --leave-out --show false-color
mosaic methods-own-camera --show false-color
say "$out/methods.jpg, methods-false-color.jpg, methods-own-camera.jpg: ${methods[*]}"
