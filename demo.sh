#!/usr/bin/env bash
# The main job: photos or a video become a lumigraph with a report and a fly-through. Installs and builds what it needs.
#
#   ./demo.sh                       on a desk that lumi-simulate photographs
#   ./demo.sh PHOTOS|VIDEO          on yours
#   ./demo.sh -o SCENE INPUT [...]  results go to SCENE instead of captures/NAME; further options go to lumi-pipeline
#   ./demo.sh --package FILE.deb [INPUT ...]    with the programs of a Debian package, which is installed: nothing is compiled
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")"
. scripts/common.sh

usage() { sed -n '2,7s/^# \{0,1\}//p' "${BASH_SOURCE[0]##*/}"; }
absolute() { case $1 in /*) printf '%s' "$1" ;; *) printf '%s/%s' "$start_folder" "$1" ;; esac; }

input='' output='' package='' more=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) usage; exit 0 ;;
    -o | --output) [ $# -ge 2 ] || die "$1 needs a folder" 2; output=$(absolute "$2"); shift 2 ;;
    --package) [ $# -ge 2 ] || die "$1 needs a .deb file" 2; package=$(absolute "$2"); shift 2 ;;
    --) shift; more+=("$@"); break ;;
    -*) # An option of lumi-pipeline, with its value where one follows.
      more+=("$1"); shift
      if [ $# -gt 0 ] && [[ $1 != -* ]] && [[ ${more[-1]} != *=* ]] && [ -n "$input" ]; then more+=("$1"); shift; fi ;;
    *) [ -z "$input" ] || die "one capture at a time (got $input and $1)" 2; input=$1; shift ;;
  esac
done
if [ -n "$input" ]; then
  input=$(absolute "$input")
  [ -e "$input" ] || die "$input does not exist" 2
fi

if [ -n "$package" ]; then
  install_package "$package"
  bin=$(dirname "$(command -v lumi-pipeline)")
else
  install_packages
  build release lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export lumi-simulate lumi-view
  bin=$PWD/build/release/bin
fi

if [ -z "$input" ]; then
  capture=captures/desk-capture
  "$bin/lumi-simulate" --example desk --views 24 --width 640 -o "$capture"
  input=$PWD/$capture/images
  name=desk
else
  # .../fountain/images is the capture "fountain"
  name=$(basename "$input")
  case $name in images | photos | frames) name=$(basename "$(dirname "$(realpath "$input")")") ;; esac
  [ -d "$input" ] || name=${name%.*}
fi
if [ -z "$output" ]; then
  output=captures/$name
  [ "$PWD" = "$start_folder" ] || output=$PWD/$output
fi

# From where the user stands: files named in further options are theirs.
(cd "$start_folder" && "$bin/lumi-pipeline" "$input" -o "$output" "${more[@]}")

say ''
if [ -n "${DISPLAY:-}${WAYLAND_DISPLAY:-}" ]; then
  say "Now walk through it: $bin/lumi-view $output"
else
  say "There is no display here: the fly-through and the contact sheet above show it. On a machine with one: $bin/lumi-view $output"
fi
