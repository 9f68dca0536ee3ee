#!/usr/bin/env bash
# Makes the pictures of README and docs/gallery.md from simulated scenes: docs/gallery/*.jpg, each below 100 KB.
#
#   scripts/gallery.sh             all of them (about ten minutes on two cores); scenes stay in build/gallery
#   scripts/gallery.sh NAME...     some: walk left-out hull grid videos periodic steady measures proxies samples
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/common.sh

all=(walk left-out hull grid videos periodic steady measures proxies samples)
wanted=("$@")
[ $# -gt 0 ] || wanted=("${all[@]}")
case ${1:-} in -h | --help) sed -n '2,5s/^# \{0,1\}//p' "scripts/${BASH_SOURCE[0]##*/}"; exit 0 ;; esac
install_packages
build release lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export lumi-stabilize lumi-timeperiodic
bin=$PWD/build/release/bin work=$PWD/build/gallery out=$PWD/docs/gallery
mkdir -p "$work" "$out"

# simulated NAME EXAMPLE OPTIONS...: a capture, made once.
simulated() {
  local name=$1 example=$2
  shift 2
  [ -f "$work/$name/lumigraph.json" ] || "$bin/lumi-simulate" --example "$example" "$@" -o "$work/$name" --quiet
}
# rendered NAME SCENE OPTIONS...: the picture that lumi-render makes of one view, as build/gallery/NAME.png.
rendered() {
  local name=$1 scene=$2
  shift 2
  rm -rf "$work/of-$name"
  "$bin/lumi-render" "$scene" -o "$work/of-$name" "$@" --quiet
  mv "$work/of-$name"/*.png "$work/$name.png"
}
# framed NAME HEIGHT PICTURE...: pictures side by side, over black, as docs/gallery/NAME.jpg of at most 100 KB.
framed() {
  local name=$1 height=$2 quality picture parts=()
  shift 2
  for picture; do
    oiiotool "$picture" --ch R,G,B --resize "0x$height" -o "$work/part-${#parts[@]}.png"
    parts+=("$work/part-${#parts[@]}.png")
  done
  oiiotool "${parts[@]}" --mosaic:pad=6 "${#parts[@]}x1" --ch R,G,B -o "$work/framed.png"
  for quality in 2 3 4 6 8 12 16; do
    jpeg_for_docs "$work/framed.png" "$quality" "$out/$name.jpg"
    [ "$(stat -c %s "$out/$name.jpg")" -gt 100000 ] || break
  done
  rm -f "${parts[@]}" "$work/framed.png"
  say "docs/gallery/$name.jpg"
}
# The photo of a capture that is the i-th of n, in their order.
photo() { ls "$work/$1/images"/* | sed -n "$((1 + $2))p"; }

simulated plaza plaza --views 60 --width 640
for picture in "${wanted[@]}"; do
  case $picture in
    walk) # a photo, a view between photos, and which photo each pixel comes from
      simulated desk desk --views 24 --width 640
      rendered between "$work/desk" --view 12 --leave-out
      rendered colours "$work/desk" --view 12 --leave-out --show false-color
      framed walk 220 "$(photo desk 11)" "$work/between.png" "$work/colours.png" ;;
    left-out) # a photo, the same from the others, four times the difference
      rendered of-others "$work/plaza" --view 30 --leave-out
      rendered difference "$work/plaza" --view 30 --leave-out --show difference
      framed left-out 220 "$(photo plaza 30)" "$work/of-others.png" "$work/difference.png" ;;
    hull) # a turntable: a photo, the visual hull, a view between photos
      simulated car car --views 36 --width 640
      "$bin/lumi-proxy" hull "$work/car" --silhouettes "$work/car/truth/silhouettes" --name hull --quiet
      rendered hull-proxy "$work/car" --proxy hull --view 7 --leave-out --show proxy
      rendered hull-view "$work/car" --proxy hull --view 7 --leave-out
      framed hull 220 "$(photo car 7)" "$work/hull-proxy.png" "$work/hull-view.png" ;;
    grid) # sparse samples: the triangles that weights are interpolated over
      rendered tessellation "$work/plaza" --view 30 --leave-out --grid 25x25 --sampling interpolated --show tessellation
      framed grid 220 "$(photo plaza 30)" "$work/tessellation.png" ;;
    videos) # several cameras at once: three moments of one view
      simulated stage stage --width 320 --fixed-frames 30
      for t in 0.1 0.4 0.7; do rendered "stage-$t" "$work/stage" --view 4 --time-s "$t"; done
      framed videos 200 "$work"/stage-0.1.png "$work"/stage-0.4.png "$work"/stage-0.7.png ;;
    periodic) # what repeats itself: four phases from one camera
      simulated lamp lamp --width 320
      for p in 0 0.25 0.5 0.75; do rendered "lamp-$p" "$work/lamp" --view 40 --phase "$p"; done
      framed periodic 180 "$work"/lamp-0.png "$work"/lamp-0.25.png "$work"/lamp-0.5.png "$work"/lamp-0.75.png ;;
    steady) # stabilisation: every 40th frame laid over each other, before and after
      [ -f "$work/steady.mp4" ] || {
        [ -f "$work/shaky/video.mp4" ] || "$bin/lumi-simulate" --example hallway --video --views 120 --width 480 --shake 1.5 -o "$work/shaky" --quiet
        "$bin/lumi-pipeline" "$work/shaky/video.mp4" --stabilize smooth -o "$work/steady.mp4" --no-score --quiet
      }
      for film in shaky/video steady; do
        name=${film%%/*}
        rm -rf "$work/frames-$name"
        mkdir "$work/frames-$name"
        ffmpeg -nostdin -loglevel error -i "$work/$film.mp4" -vf "crop=iw:2:0:ih/2,scale=480:2" "$work/frames-$name/%04d.png"
        # A line of each frame, one below the other: the shake is a jagged edge.
        oiiotool "$work/frames-$name"/*.png --mosaic "1x$(ls "$work/frames-$name" | wc -l)" -o "$work/lines-$name.png"
      done
      framed steady 220 "$work/lines-shaky.png" "$work/lines-steady.png" ;;
    measures) # angle, resolution and visibility of the photo that weighs most
      simulated desk desk --views 24 --width 640
      for m in weights angle visibility; do rendered "map-$m" "$work/desk" --view 12 --leave-out --show "$m"; done
      framed measures 180 "$work/map-weights.png" "$work/map-angle.png" "$work/map-visibility.png" ;;
    proxies) # one scene over a plane, a mesh of its points, and the truth
      simulated desk desk --views 24 --width 640
      "$bin/lumi-proxy" plane "$work/desk" --quiet
      "$bin/lumi-proxy" delaunay "$work/desk" --quiet
      for p in plane delaunay; do rendered "over-$p" "$work/desk" --proxy "$p" --view 12 --leave-out; done
      rendered mesh-proxy "$work/desk" --proxy delaunay --view 12 --show proxy
      framed proxies 180 "$work/over-plane.png" "$work/over-delaunay.png" "$work/mesh-proxy.png" ;;
    samples) # cameras of a capture and the view that is rendered
      rendered cameras "$work/plaza" --view 30 --show cameras
      framed samples 220 "$work/cameras.png" ;;
    *) die "there is no picture $picture (see --help)" 2 ;;
  esac
done
