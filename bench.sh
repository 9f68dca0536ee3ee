#!/usr/bin/env bash
# Prints every figure that README and docs quote, as Markdown; the same as JSON is in build/bench/figures.json.
#
#   ./bench.sh               on a desk that lumi-simulate photographs
#   ./bench.sh --data DIR    also on fountain, sceaux, fox, boards-stereo, boards-wide, shaky-sideways and shaky-rotation below DIR
#   ./bench.sh --only NAME   on one of them;  --views N photos rendered at their own cameras (4)
#   ./bench.sh --only stabilize   only stabilisation: simulated walks, and below DIR the shaky videos, beside vid.stab's results
#   ./bench.sh --only cameras     only cameras by our features beside COLMAP's: seconds a step, photos placed, errors (also of dinosaur below DIR)
#   ./bench.sh --only walk        only cameras of a simulated walk in shuffled order: 50, 100 and 200 photos; --photos 1000 others
#   ./bench.sh --only dense       only dense proxies beside sparse ones, on simulated captures and on scenes that are in build/bench
#   ./bench.sh --only dense-cost  of these only what they take: seconds, memory, milliseconds a frame, the fly-through
#   ./bench.sh --only flush       only what waiting for the disk costs the pipeline
#   ./bench.sh --only video       only reading videos: frames a second of 1080p beside the decoder alone and OpenCV's reader
#   ./bench.sh --only web         only web pages in Chromium: against lumi-render, frame time, first picture, memory (1,000 photos streamed)
#   ./bench.sh --only methods DIR   only this renderer beside published methods, on every scene or COLMAP workspace in DIR
#   ./bench.sh --speed       only what rendering costs: the optimum, sparse samples and their blends on the CPU and in OpenGL, each
#                            beside its baseline; sparse samples against a weight a pixel on the 262 photos of the simulated desk, and
#                            on fox and knights below DIR
# Scenes are kept in build/bench: a second run measures again without finding the cameras again.
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")"
. scripts/common.sh

arguments=() data='' only_speed='' only_quality='' only_stabilize='' only_dense='' only_cameras='' only_flush='' only_video='' only_walk='' only_web='' only_methods='' walk_photos=50,100,200
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,20s/^# \{0,1\}//p' "${BASH_SOURCE[0]##*/}"; exit 0 ;;
    --data)
      [ $# -ge 2 ] || die "--data needs a folder" 2
      case $2 in /*) data=$2 ;; *) data=$start_folder/$2 ;; esac
      [ -d "$data" ] || die "$data is no folder" 2
      arguments+=(--data "$data"); shift 2 ;;
    --speed) only_speed=1; shift ;;
    --only)
      if [ "${2:-}" = stabilize ]; then only_stabilize=1; shift 2; continue; fi
      if [ "${2:-}" = walk ]; then only_walk=1; shift 2; continue; fi
      if [ "${2:-}" = cameras ]; then only_cameras=1; shift 2; continue; fi
      if [ "${2:-}" = flush ]; then only_flush=1; shift 2; continue; fi
      if [ "${2:-}" = web ]; then only_web=1; shift 2; continue; fi
      if [ "${2:-}" = methods ]; then
        [ $# -ge 3 ] || die "--only methods needs a folder of scenes" 2
        case $3 in /*) only_methods=$3 ;; *) only_methods=$start_folder/$3 ;; esac
        [ -d "$only_methods" ] || die "$only_methods is no folder" 2
        shift 3; continue
      fi
      if [ "${2:-}" = video ]; then only_video=1; shift 2; continue; fi
      case ${2:-} in dense | dense-cost) only_dense=$2; shift 2; continue ;; esac
      only_quality=1; arguments+=("$1"); shift ;;
    --photos)
      [ $# -ge 2 ] || die "--photos needs numbers" 2
      walk_photos=$2; shift 2 ;;
    *) arguments+=("$1"); shift ;;
  esac
done

install_packages
stabilisation=(lumi-pipeline lumi-reconstruct lumi-render lumi-simulate lumi-stabilize stabilize_bench steady_path_bench)
if [ -n "$only_cameras" ]; then build release lumi-simulate lumi-reconstruct cameras_bench
elif [ -n "$only_walk" ]; then build release lumi-simulate lumi-reconstruct walk_bench
elif [ -n "$only_methods" ]; then build release lumi-export lumi-pipeline lumi-proxy lumi-reconstruct lumi-render
elif [ -n "$only_video" ]; then build release video_bench
elif [ -n "$only_web" ]; then build release lumi-export lumi-simulate web_bench
elif [ -n "$only_flush" ]; then build release lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export fault_injection
elif [ -n "$only_dense" ]; then build release lumi-simulate lumi-proxy lumi-render depth_bench
elif [ -n "$only_stabilize" ]; then build release "${stabilisation[@]}"; else
  build release "${stabilisation[@]}" lumi-proxy fault_injection bench_figures cameras_bench walk_bench depth_bench calibration_bench optimum_bench hull_bench sparse_blend_bench gl_blend_bench view_triangulation_bench timeperiodic_bench time_scenes_bench video_bench web_bench test_render_hard_cases test_calibrate test_calibrate_simulated_boards factorization_bench factorization_test real_captures_test reconstruct_data_test vanishing_point_bench
fi
bin=build/release/bin work=build/bench
mkdir -p "$work"
printf 'Built with %s; %s; %s cores.\n\n' "$(cat build/release/versions.txt)" "$(colmap help 2>/dev/null | grep -o 'COLMAP [0-9.]*' | head -n 1)" "$(nproc)"
cameras() {
  printf '\n## Cameras by our features and by those of COLMAP\n\n'
  "$bin/cameras_bench" --work "$work" ${data:+--data "$data"}
}
walk() {
  printf '\n## Cameras of a walk in shuffled order\n\n'
  "$bin/walk_bench" --work "$work" --photos "$walk_photos"
}
if [ -n "$only_cameras" ]; then
  cameras
  exit 0
fi
if [ -n "$only_walk" ]; then
  walk
  exit 0
fi
# methods FOLDER: all scenes in it. A workspace without proxies becomes a scene of ours first, whose proxies know no held-out photo.
methods() {
  local folder scene name results=()
  for folder in "$1"/*/; do
    folder=${folder%/} name=${folder##*/} scene=$folder
    [ -e "$folder/lumigraph.json" ] || [ -d "$folder/sparse" ] || [ -e "$folder/transforms.json" ] || continue
    if [ ! -d "$folder/proxies" ]; then
      scene=$work/methods/scenes/$name
      "$bin/lumi-pipeline" "$folder" -o "$scene" >/dev/null || { say "left out: $name"; continue; }
    fi
    "$bin/lumi-render" methods "$scene" -o "$work/methods/$name" --quiet || { say "left out: $name"; continue; }
    results+=("$work/methods/$name/methods.json")
  done
  [ ${#results[@]} -gt 0 ] || die "no scene in $1" 1
  printf '\n## Published methods, held out\n\n'
  "$bin/lumi-render" methods-report "${results[@]}"
}
if [ -n "$only_methods" ]; then
  methods "$only_methods"
  exit 0
fi
# Whole captures: of DIR those whose scenes an earlier run left in build/bench.
web_pages() {
  local scene scenes=()
  for scene in fox sceaux fountain; do
    [ ! -f "$work/$scene/lumigraph.json" ] || scenes+=(--capture "$work/$scene")
  done
  printf '\n## Web pages in Chromium\n\n'
  "$bin/web_bench" --work "$work" "${scenes[@]}" --streamed 1000 || {
    [ $? -eq 4 ] || return 1
    say "no browser: web pages are not measured"
  }
}
if [ -n "$only_web" ]; then
  web_pages
  exit 0
fi
[ -n "$only_speed$only_stabilize$only_dense$only_video$only_flush" ] || "$bin/bench_figures" --work "$work" "${arguments[@]}"
# What waiting for the disk takes of the whole pipeline on 24 photos: each flush is timed, by a library that is preloaded.
flush_cost() {
  local photos=$work/flush-desk scene=$work/flush-scene log=$work/flush.log begin
  [ -d "$photos/truth" ] || "$bin/lumi-simulate" --example desk --views 24 --width 640 -o "$photos" --quiet
  rm -rf "$scene" "$log"
  begin=$(date +%s.%N)
  LD_PRELOAD=$PWD/$bin/../tests/libfault_injection.so LUMI_FLUSH_LOG=$log \
    "$bin/lumi-pipeline" "$photos/images" -o "$scene" --poses "$photos/truth/sparse" --quiet >/dev/null
  printf '\n## Waiting for the disk: the pipeline on 24 photos\n\n| seconds | of these waiting | flushes | share %% |\n|---|---|---|---|\n'
  awk -v begin="$begin" -v end="$(date +%s.%N)" '$1 == "flushed" { waited += $2 / 1e6; n += 1 }
    END { printf "| %.1f | %.2f | %d | %.2f |\n", end - begin, waited, n, 100 * waited / (end - begin) }' "$log"
  rm -rf "$scene" "$log"
}
if [ -n "$only_flush" ]; then
  flush_cost
  exit 0
fi
[ -n "$only_speed$only_stabilize$only_dense$only_quality" ] || flush_cost
# Dense proxies beside the sparse mesh: held-out photos, none of which the proxies know; pixels that two photos see over
# the dense one. Then depth against the truth.
dense_figure() { grep -o "\"$2\": *[0-9.]*" <<<"$1" | head -n 1 | grep -o '[0-9.]*$' | cut -c1-"${3:-6}"; }
# SCENE PROXY SEEN_PROXY WIDTH: a held-out evaluation as JSON.
dense_held_out() {
  "$bin/lumi-render" "$1" -o "$work/dense-frames" --proxy "$2" --seen-proxy "$3" --holdout 8 --width "$4" --json --quiet
  rm -rf "$work/dense-frames"
}
# As the first version evaluated: the sparse mesh of all photos, dense ones without depth of the held-out photos, but with the choosing fold's.
dense_rows() {
  local scene=$1 width=$2 name=${1##*/} made json proxy over old
  [ -f "$scene/lumigraph.json" ] || return 0
  "$bin/lumi-proxy" delaunay "$scene" --leave-out 8 --quiet >/dev/null
  "$bin/lumi-proxy" delaunay "$scene" --name mesh-first --quiet >/dev/null
  "$bin/lumi-proxy" dense "$scene" --name dense-first --width "$width" --leave-out 8 --keep-choosing-fold --quiet >/dev/null
  "$bin/lumi-proxy" dense "$scene" --name dense-strict-first --agree 3 --width "$width" --leave-out 8 --keep-choosing-fold --quiet >/dev/null
  for proxy in dense dense-strict mesh true; do
    made='' old='' over=$proxy-without-8
    case $proxy in
      dense) made=$("$bin/lumi-proxy" dense "$scene" --width "$width" --leave-out 8 --json --quiet) old=dense-first ;;
      dense-strict)
        made=$("$bin/lumi-proxy" dense "$scene" --name dense-strict --agree 3 --width "$width" --leave-out 8 --json --quiet)
        old=dense-strict-first ;;
      mesh) old=mesh-first ;;
      true) over=$scene/truth/mesh.ply; [ -f "$over" ] || continue ;;
    esac
    json=$(dense_held_out "$scene" "$over" dense-without-8 "$width")
    [ -z "$old" ] || old=$(dense_held_out "$scene" "$old" dense-first "$width")
    printf '| %s | %s | %s | %s | %s | %s | %s | %s | %s | %s | %s |\n' "$name" "$proxy" "$(dense_figure "$json" psnr_mean_db 5)" "$(dense_figure "$json" psnr_seen_mean_db 5)" \
      "$(dense_figure "$json" seen 5)" "$(dense_figure "$json" ssim_mean 5)" "$(dense_figure "$old" psnr_mean_db 5)" "$(dense_figure "$old" psnr_seen_mean_db 5)" \
      "$(dense_figure "$old" ssim_mean 5)" "$(dense_figure "$made" photos)" "$(dense_figure "$made" seconds)"
  done
}
# Few photos: each left out in turn, over proxies that do not know it. (A proxy of the plain name must be there, and is not used.)
dense_each_rows() {
  local scene=$1 width=$2 kind json
  [ -f "$scene/lumigraph.json" ] || return 0
  for kind in mesh dense dense-strict; do "$bin/lumi-proxy" delaunay "$scene" --name "each-$kind" --quiet >/dev/null; done
  "$bin/lumi-proxy" delaunay "$scene" --name each-mesh --leave-out each --quiet >/dev/null
  "$bin/lumi-proxy" dense "$scene" --name each-dense --leave-out each --width "$width" --quiet >/dev/null
  "$bin/lumi-proxy" dense "$scene" --name each-dense-strict --agree 3 --leave-out each --width "$width" --quiet >/dev/null
  for kind in mesh dense dense-strict; do
    json=$("$bin/lumi-render" "$scene" -o "$work/dense-frames" --proxy "each-$kind" --seen-proxy each-mesh --holdout each --width "$width" --json --quiet)
    rm -rf "$work/dense-frames"
    printf '| %s | %s | %s | %s | %s | %s | %s |\n' "${scene##*/}" "$kind" "$(dense_figure "$json" psnr_mean_db 5)" "$(dense_figure "$json" psnr_seen_mean_db 5)" \
      "$(dense_figure "$json" seen 5)" "$(dense_figure "$json" ssim_mean 5)" "$(dense_figure "$json" coverage 5)"
  done
}
simulated_for_dense() { [ -f "$work/dense-$1/lumigraph.json" ] || "$bin/lumi-simulate" --example "$1" --views 24 --width 640 -o "$work/dense-$1" --quiet; }
dense() {
  local example
  printf '\n## Dense proxies\n\n| capture | proxy | all pixels dB | seen dB | seen | SSIM | evaluated as at first: dB | seen dB | SSIM | photos | seconds |\n|---|---|---|---|---|---|---|---|---|---|---|\n'
  for example in desk plaza hallway; do
    simulated_for_dense $example
    dense_rows "$work/dense-$example" 640
  done
  for example in fox fountain sceaux; do dense_rows "$work/$example" 800; done
  printf '\n| each photo left out | proxy | all pixels dB | seen dB | seen | SSIM | coverage |\n|---|---|---|---|---|---|---|\n'
  for example in fountain sceaux; do dense_each_rows "$work/$example" 640; done
  printf '\n| capture | depth of | complete %% | within 1 %% | within 0.2 %% | of all within 1 %% |\n|---|---|---|---|---|---|\n'
  for example in desk plaza hallway; do
    "$bin/lumi-proxy" dense "$work/dense-$example" --depth-only --quiet >/dev/null
    "$bin/lumi-proxy" dense "$work/dense-$example" --quiet >/dev/null
    "$bin/lumi-proxy" delaunay "$work/dense-$example" --quiet >/dev/null
    "$bin/depth_bench" "$work/dense-$example" mesh dense
  done
}
dense_costs() {
  simulated_for_dense desk
  [ -f "$work/dense-desk/proxies/mesh.ply" ] || "$bin/lumi-proxy" delaunay "$work/dense-desk" --quiet >/dev/null
  [ -f "$work/dense-desk/proxies/dense.ply" ] || "$bin/lumi-proxy" dense "$work/dense-desk" --quiet >/dev/null
  printf '\n| capture | depth maps px | seconds a photo | their peak MB | points | mesh s | fewer faces s | whole command, peak MB |\n|---|---|---|---|---|---|---|---|\n'
  dense_cost "$work/dense-desk" 640 1.5
  dense_cost "$work/dense-desk" 640 1
  dense_cost "$work/fountain" 1000 1
  printf '\n| capture | drawn | sparse mesh ms | dense mesh ms | ratio | all of its faces ms |\n|---|---|---|---|---|---|\n'
  dense_frames "$work/dense-desk"
}
# What depth and meshing take: SCENE WIDTH MERGE_PX, everything anew; depth maps once more by themselves, for their own peak.
dense_cost() {
  local made folder
  [ -f "$1/lumigraph.json" ] || return 0
  folder=$(mktemp -d)
  peak_mb "$folder/depth_mb" "$bin/lumi-proxy" dense "$1" --width "$2" --depth-only -o "$folder/stereo" --quiet >/dev/null
  made=$(peak_mb "$folder/mb" "$bin/lumi-proxy" dense "$1" --width "$2" --merge-px "$3" -o "$folder/dense.ply" --json --quiet)
  awk -v name="${1##*/}" -v width="$2" -v depth_mb="$(cat "$folder/depth_mb")" -v mb="$(cat "$folder/mb")" '
    /"(photos|points_used|tetrahedra|lines_of_sight|cut|surface|simplify_seconds)":/ { gsub(/[",]/, ""); sub(":", ""); value[$1] = $2 }
    /"seconds":/ && !depth { gsub(/,/, ""); depth = $2 }
    END {
      printf "| %s | %d | %.1f | %s | %d | %.1f | %.1f | %s |\n", name, width, depth / value["photos"], depth_mb, value["points_used"],
        value["tetrahedra"] + value["lines_of_sight"] + value["cut"] + value["surface"], value["simplify_seconds"], mb
    }' <<<"$(sed -n '/"depth"/,$p' <<<"$made")"
  rm -rf "$folder"
}
# peak_mb FILE COMMAND...: runs it, and leaves its largest resident size in FILE, in megabytes; "-" without Debian's package `time`.
peak_mb() {
  local file=$1
  shift
  if [ ! -x /usr/bin/time ]; then
    echo - >"$file"
    "$@"
  else
    /usr/bin/time -f %M -o "$file.kb" "$@"
    awk '{ printf "%d", $1 / 1024 }' "$file.kb" >"$file"
  fi
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
        for proxy in mesh dense dense-all; do
          json=$("$bin/lumi-render" "$scene" -o "$work/dense-frames" --proxy "$proxy" --backend "$backend" --grid "$grid" --seconds 1 --width 640 --json --quiet)
          rm -rf "$work/dense-frames"
          ms=$(grep -o '"ms_per_frame": *[0-9.]*' <<<"$json" | grep -o '[0-9.]*$')
          least[$proxy]=$(awk -v a="${least[$proxy]:-1e9}" -v b="$ms" 'BEGIN { print a < b ? a : b }')
        done
      done
      awk -v name="${scene##*/}" -v how="$backend, $grid" -v m="${least[mesh]}" -v d="${least[dense]}" -v a="${least[dense-all]}" \
        'BEGIN { printf "| %s | %s | %.1f | %.1f | %.2f | %.1f |\n", name, how, m, d, d / m, a }'
    done
  done
}
# The pipeline's fly-through beside a weight at every pixel: ms a frame, and dB between the frames before they are compressed.
fly_through() {
  local scene=$1 way json folder=$work/fly-through-${1##*/} over=()
  [ -z "${2:-}" ] || over=(--proxy "$2")
  for way in pixel sparse; do
    [ "$way" = pixel ] && options=() || options=(--fidelity-db 40)
    rm -rf "$folder-$way"
    json=$("$bin/lumi-render" "$scene" -o "$folder-$way" --width 960 --seconds 6 "${over[@]}" "${options[@]}" --json --quiet)
    printf '%-7s %s ms a frame%s\n' "$way" "$(grep -o '"ms_per_frame": *[0-9.]*' <<<"$json" | grep -o '[0-9.]*$' | cut -c1-5)" \
      "$(grep -o '"name": *"[a-z]* [0-9]*x[0-9]*, k [0-9]*"' <<<"$json" | head -n 1 | cut -d'"' -f4 | sed 's/^/  /')"
  done
  # Over black, as the video has them.
  over_black='format=gbrap,premultiply=inplace=1,format=gbrp'
  ffmpeg -nostdin -hide_banner -i "$folder-sparse/frames/frame_%06d.png" -i "$folder-pixel/frames/frame_%06d.png" \
    -filter_complex "[0]$over_black[a];[1]$over_black[b];[a][b]psnr" -f null - 2>&1 | sed -n 's/.*average:\([^ ]*\) min:\([^ ]*\).*/PSNR between them \1 dB over all frames, \2 dB at the worst/p'
  rm -rf "$folder-pixel" "$folder-sparse"
}
# Of 1080p, 8 bits in H.264.
video_reading() {
  local clip=$work/video-1080p.mp4
  [ -f "$clip" ] || {
    ffmpeg -nostdin -y -loglevel error -f lavfi -i testsrc2=s=1920x1080:r=30:d=10 -vf noise=alls=6:allf=t -c:v libx264 -preset fast -crf 23 -pix_fmt yuv420p "$work/video-part.mp4"
    mv "$work/video-part.mp4" "$clip"
  }
  printf '\n## Reading a video of 1080p\n\n'
  "$bin/video_bench" "$clip"
}
if [ -n "$only_video" ]; then
  video_reading
  exit 0
fi
if [ -n "$only_dense" ]; then
  [ "$only_dense" = dense-cost ] || dense
  dense_costs
  printf '\n### The fly-through, 960 px wide: dense-desk\n\n```\n'
  fly_through "$work/dense-desk" dense
  printf '```\n'
  exit 0
fi
# What --effects auto decides by judgement, against the other way: held-out PSNR in dB.
effects_row() {
  printf '| %s | %s |' "${1##*/}" "$2"
  for options in '' '--prefilter off' '--prefilter on' '--resolution off' '--resolution jacobian'; do
    # shellcheck disable=SC2086
    printf ' %s |' "$("$bin/lumi-render" "$1" --holdout 8 --width "$2" $options --json --quiet | grep -o '"psnr_mean_db": *[0-9.]*' | grep -o '[0-9.]*$' | cut -c1-5)"
  done
  printf '\n'
}
# timed FILE COMMAND...: runs it, and adds a line to FILE: seconds, and seconds of all processors.
timed() {
  local file=$1 TIMEFORMAT='%R %U %S'
  shift
  { time "$@" 2>&3; } 3>&2 2>"$file.part"
  awk 'END { print $1, $2 + $3 }' "$file.part" >>"$file"
  rm -f "$file.part"
}
# stabilised NAME VIDEO SCALE [MORE...]: rows of VIDEO, MORE, vid.stab's results (its defaults, and smoother) and ours, cropped to SCALE of
# the width at most, and cropped as vid.stab's smoother one. Videos and figures that are there already are taken.
stabilised() {
  local name=$1 video=$2 scale=$3 folder=$work/stabilised/$1 smoothing filters v same_scale=''
  shift 3
  mkdir -p "$folder"
  local videos=("$@")
  filters=$(ffmpeg -hide_banner -filters 2>/dev/null)
  case $filters in
    *vidstabtransform*)
      [ -f "$folder/motion.trf" ] || {
        rm -f "$folder/motion.seconds"
        timed "$folder/motion.seconds" ffmpeg -nostdin -y -loglevel error -i "$video" -vf "vidstabdetect=result=$folder/motion.part" -f null -
        mv "$folder/motion.part" "$folder/motion.trf"
      }
      for smoothing in 15 30; do
        [ -f "$folder/vidstab-$smoothing.mp4" ] || {
          if [ -f "$folder/motion.seconds" ]; then cp "$folder/motion.seconds" "$folder/vidstab-$smoothing.seconds"; fi
          timed "$folder/vidstab-$smoothing.seconds" ffmpeg -nostdin -y -loglevel error -i "$video" -vf "vidstabtransform=input=$folder/motion.trf:smoothing=$smoothing" \
            -c:v libx264 -crf 18 -pix_fmt yuv420p -an "$folder/part.mp4"
          mv "$folder/part.mp4" "$folder/vidstab-$smoothing.mp4"
        }
        videos+=("$folder/vidstab-$smoothing.mp4")
      done
      [ -f "$folder/same-scale" ] || "$bin/lumi-stabilize" score "$video" "$folder/vidstab-30.mp4" --json |
        sed -n 's/.*"cropping_ratio": *\([0-9.]*\).*/\1/p' | awk '{ last = $1 } END { if (last > 0) printf "%.3f", last > 1 ? 1 : last }' >"$folder/same-scale"
      same_scale=$(cat "$folder/same-scale")
      [ "$same_scale" != "$scale" ] || same_scale='' ;;
    *) say "this ffmpeg has no vid.stab: its rows are left out" ;;
  esac
  for scale in $scale $same_scale; do
    [ -f "$folder/smooth-$scale.mp4" ] || {
      rm -rf "$folder/smooth-$scale.seconds" "$folder/smooth-$scale-work"
      timed "$folder/smooth-$scale.seconds" "$bin/lumi-pipeline" "$video" --stabilize smooth --min-scale "$scale" -o "$folder/smooth-$scale.mp4" --no-score >/dev/null
    }
    videos+=("$folder/smooth-$scale.mp4")
  done
  for v in "${videos[@]}"; do [ "$folder/score.txt" -nt "$v" ] || rm -f "$folder/score.txt"; done
  [ -f "$folder/score.txt" ] || {
    "$bin/lumi-stabilize" score "$video" "${videos[@]}" >"$folder/score.part"
    mv "$folder/score.part" "$folder/score.txt"
  }
  # Of lumi-stabilize's columns the first six, and the clip's name before them.
  # Seconds where they were taken: what a video is made of together.
  awk -v name="$name" -v folder="$folder" '
    NR > 1 {
      file = $1; sub(/\.mp4$/, ".seconds", file); seconds = cpu = 0
      while ((getline line < (folder "/" file)) > 0) { split(line, s, " "); seconds += s[1]; cpu += s[2] }
      printf "| %s | %s | %s | %s | %s | %s | %s |", name, NR == 2 ? "as filmed" : $1 == "video.mp4" ? "filmed steadily" : $1, $2, $3, $4, $5, $6
      if (seconds) printf " %.1f | %.1f |\n", seconds, cpu; else print " | |"
    }' "$folder/score.txt"
}
shaky_walk() { printf '%s/shaky-%s' "$work" "$1"; }
# The simulated walks' videos with and without their shake, and the path that the walk was meant to be.
shaky_walks() {
  local example model object folder
  for example in hallway plaza vertigo; do
    [ -f "$(shaky_walk $example)/video.mp4" ] || "$bin/lumi-simulate" --example "$example" --video --views 240 --width 480 --shake 1.5 -o "$(shaky_walk $example)" --quiet
    [ -f "$work/steady-$example/video.mp4" ] || "$bin/lumi-simulate" --example "$example" --video --views 240 --width 480 --steady -o "$work/steady-$example" --quiet
    case $example in
      vertigo) model=vertigo object=(--object "160,80,155,200") ;;
      *) model=linear object=() ;;
    esac
    folder=$work/stabilised/$example
    mkdir -p "$folder"
    [ -f "$folder/$model.mp4" ] || "$bin/lumi-pipeline" "$(shaky_walk $example)/video.mp4" --stabilize "$model" "${object[@]}" --no-score -o "$folder/$model.mp4" >/dev/null
    printf '\n### %s, %s, against the ideal path\n\n```\n' "$example" "$model"
    "$bin/steady_path_bench" "$(shaky_walk $example)" "$folder/$model-work/window-000/scene" "$folder/$model-work/window-000/path.json" "$folder/$model.mp4" "$work/steady-$example/video.mp4" "${object[@]}"
    printf '```\n'
  done
}
stabilisation() {
  printf '\n## Stabilisation of simulated walks\n\n```\n'
  "$bin/stabilize_bench"
  printf '```\n'
  shaky_walks
  printf '\n## Stabilised videos beside vid.stab'"'"'s\n\n'
  printf '| clip | video | cropping | distortion | stability | jitter px | kept area | seconds | CPU seconds |\n|---|---|---|---|---|---|---|---|---|\n'
  # The steady camera's own video is the row after the input.
  for example in hallway plaza vertigo; do stabilised "$example" "$(shaky_walk $example)/video.mp4" 0.8 "$work/steady-$example/video.mp4"; done
  # Cropped no more than vid.stab by default.
  if [ -n "$data" ] && [ -d "$data/shaky-sideways" ]; then
    # The same once more as if it were long: in windows.
    video=$data/shaky-sideways/shaky-5.avi folder=$work/stabilised/shaky-sideways
    mkdir -p "$folder"
    [ -f "$folder/windows.json" ] || {
      "$bin/lumi-pipeline" "$video" --stabilize smooth --min-scale 0.88 --window-frames 240 -o "$folder/windows.mp4" --no-score --json >"$folder/windows.part"
      mv "$folder/windows.part" "$folder/windows.json"
    }
    stabilised shaky-sideways "$video" 0.88 "$folder/windows.mp4"
    memory=$(grep -o '"peak_memory_mb": *[0-9]*' "$folder/windows.json" | grep -o '[0-9]*$')
  fi
  if [ -n "$data" ] && [ -d "$data/shaky-rotation" ]; then stabilised shaky-rotation "$data/shaky-rotation/view.mp4" 0.94; fi
  [ -z "${memory:-}" ] || printf '\nshaky-sideways in windows of at most 240 frames (windows.mp4): %s MB at most.\n' "$memory"
}
if [ -n "$only_stabilize" ]; then
  stabilisation
  exit 0
fi
if [ -z "$only_speed" ]; then
  printf '\n## Effects on demand: auto, and an effect off or on\n\n'
  printf '| capture | width | auto | prefilter off | on | resolution off | Jacobian |\n|---|---|---|---|---|---|---|\n'
  for scene in desk fox sceaux fountain; do
    [ -f "$work/$scene/lumigraph.json" ] || continue
    for width in 160 320 640; do effects_row "$work/$scene" "$width"; done
  done
fi
[ -n "$only_speed" ] || { dense; dense_costs; }
# Photos that are left out are sharp; off last, as its cost is measured beside.
sharpness() {
  local blurred=$work/plaza-blurred delta
  [ -f "$blurred/lumigraph.json" ] ||
    "$bin/lumi-simulate" --example plaza --views 36 --width 480 --blur-s 0.08 --blur-every 3 -o "$blurred" --quiet
  printf '\n## Sharpness: plaza with every third photo blurred by motion\n\n| `--delta` | held-out PSNR, dB | ms a frame |\n|---|---|---|\n'
  sharpness_row() {
    local label=$1 json
    shift
    json=$("$bin/lumi-render" "$blurred" --holdout 6 --json --quiet "$@")
    printf '| %s | %s | %s |\n' "$label" "$(grep -o '"psnr_mean_db": *[0-9.]*' <<<"$json" | grep -o '[0-9.]*$' | cut -c1-5)" \
      "$(grep -o '"ms_per_frame": *[0-9.]*' <<<"$json" | grep -o '[0-9.]*$' | cut -c1-5)"
  }
  for delta in 1 2 4 8 20; do sharpness_row "$delta" --sharpness on --delta "$delta"; done
  sharpness_row 'auto (4)'
  sharpness_row off --sharpness off
}
[ -n "$only_speed$only_quality" ] || sharpness
if [ -z "$only_speed$only_quality" ]; then
  cameras
  walk
  web_pages
  printf '\n## Calibration\n\n'
  [ -z "$data" ] || "$bin/calibration_bench" "$data"
  printf '\nStandard deviations against the spread over 100 simulated sets, and ray-traced boards:\n\n```\n'
  "$bin/test_calibrate" --gtest_filter=Refinement.StandardDeviations* --gtest_brief=1 | grep ratio
  "$bin/test_calibrate_simulated_boards" --gtest_brief=1 | grep -E 'sigma|views'
  printf '```\n'
  # Against the desk's true cameras. A run's own row, "as given", is what lumi-reconstruct does without options.
  focal=$(grep -m1 -A1 '"params"' "$work/desk-capture/truth/cameras.json" | sed -n '2s/[^0-9.]//gp')
  # Held to their bounds by tests, which print what they see: a square, a drive and a desk, simulated, and a road.
  printf '\n## Cameras without COLMAP, against the truth\n\n```\n'
  "$bin/factorization_test" --gtest_filter='*CanBeLookedAt:FactorizedDrive.*' --gtest_brief=1 | grep centres
  "$bin/real_captures_test" --gtest_filter='DeskByFactorisation.*' --gtest_brief=1 | grep centres
  [ -z "$data" ] || "$bin/reconstruct_data_test" --gtest_filter='*Road*' --gtest_brief=1 | grep centres || true
  printf '```\n'
  printf '\nOn simulated tracks with 0.3 px of noise (rms P: projective, in px; rms M: metric; milliseconds a stage):\n\n```\n'
  "$bin/factorization_bench"
  printf '```\n'
  for example in lamp helicopter; do
    [ -d "$work/$example/truth" ] || "$bin/lumi-simulate" --example "$example" --width 240 -o "$work/$example"
  done
  # Two of its three seconds.
  [ -d "$work/stage/truth" ] || "$bin/lumi-simulate" --example stage --width 240 --fixed-frames 60 -o "$work/stage"
  printf '\n## Several videos at once: stage, which begins at 9, 0, 14, 3, 21, 7, 12, 5\n\n```\n'
  rm -rf "$work/stage-scene"
  "$bin/lumi-reconstruct" "$work/stage/videos" -o "$work/stage-scene" 2>&1 | grep 'start at frames'
  printf '```\n\n## Scenes that carry times\n\n'
  "$bin/time_scenes_bench" "$work" ${data:+"$data"}
  printf '\n## Time-periodic scenes\n\n'
  "$bin/timeperiodic_bench" "$work" ${data:+"$data"}
  for example in 'lamp 150.37' 'helicopter 15.37'; do
    printf '\n## lumi-timeperiodic period --tradeoff: %s\n\n```\n' "${example% *}"
    "$bin/lumi-timeperiodic" period "$work/${example% *}/fixed.mp4" --true-period "${example#* }" --tradeoff "$work/${example% *}-period"
    printf '```\n'
  done
  printf '\n## lumi-timeperiodic calibrate --tradeoff: helicopter\n\n```\n'
  "$bin/lumi-timeperiodic" calibrate "$work/helicopter/video.mp4" -o "$work/helicopter-calibrated" --fixed-video "$work/helicopter/fixed.mp4" --tradeoff
  printf '```\n'
  for example in lamp helicopter; do
    # From the video alone, as wide as the example is, and its period from a tripod's.
    capture=$work/$example-whole
    [ -d "$capture/truth" ] || "$bin/lumi-simulate" --example "$example" -o "$capture"
    "$bin/lumi-pipeline" "$capture/video.mp4" -o "$work/$example-periodic" --periodic --fixed-video "$capture/fixed.mp4" --no-video --quiet
    printf '\n## lumi-pipeline --periodic: %s\n\n' "$example"
    "$bin/timeperiodic_bench" reconstructed "$example" "$capture" "$work/$example-periodic"
  done
  stabilisation
  for backend in factorization colmap; do
    more=()
    [ "$backend" = colmap ] || more=(--focal-px "$focal")
    printf '\n## lumi-reconstruct --tradeoff: desk, %s\n\n```\n' "$backend"
    "$bin/lumi-reconstruct" "$work/desk-capture/images" -o "$work/desk-$backend" --backend "$backend" "${more[@]}" --tradeoff
    printf '```\n'
  done
fi
[ -z "$only_quality" ] || exit 0

if [ -z "$only_speed" ]; then
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
    [ -d "$work/$example" ] || "$bin/lumi-simulate" --example "$example" -o "$work/$example" --quiet
    printf '\n## lumi-proxy hull: %s (2 threads)\n\n```\n' "$example"
    "$bin/lumi-proxy" hull "$work/$example" --silhouettes "$work/$example/truth/silhouettes" -o "$work/$example-hull.ply" --threads 2
    printf '```\n'
  done
  printf '\n## lumi-proxy hull --tradeoff: car (2 threads)\n\n```\n'
  "$bin/lumi-proxy" hull "$work/car" --silhouettes "$work/car/truth/silhouettes" --tradeoff --threads 2
  printf '```\n'
fi

# Faces against error against time, as lumi-proxy prints it.
simplified() {
  [ -d "$work/$1/proxies" ] && [ -f "$work/$1/proxies/hull.ply" ] || {
    "$bin/lumi-simulate" --example "$1" -o "$work/$1" && cp -r "$work/$1/truth/silhouettes" "$work/$1/silhouettes" && "$bin/lumi-proxy" hull "$work/$1"
  } >/dev/null
  "$bin/lumi-proxy" simplify "$work/$1" --from hull --tradeoff
}
heading() { printf '\n## %s\n\n' "$1"; }
# table TITLE COMMAND...: as it prints.
table() {
  heading "$1"
  shift
  printf '```\n'
  "$@"
  printf '```\n'
}
table 'The optimum (2 threads)' "$bin/optimum_bench"
table 'The optimum in narrower registers' "$bin/optimum_bench" --widths
table "Weights across occluders' edges" "$bin/test_render_hard_cases" --gtest_filter='Continuity.HoldsAcrossOcclusionEdges*' --gtest_brief=1
table 'Sparse samples, CPU (2 threads)' "$bin/sparse_blend_bench" time views
table 'Sparse samples, OpenGL' "$bin/gl_blend_bench"
video_reading

if [ ! -d "$work/desk-262" ]; then
  "$bin/lumi-simulate" --example desk -o "$work/desk-262"
  "$bin/lumi-proxy" plane "$work/desk-262"
fi
table 'Sparse samples against a weight a pixel: desk, foreground, plane' "$bin/sparse_blend_bench" psnr --scene "$work/desk-262" --proxy plane
table 'The same, true mesh' "$bin/sparse_blend_bench" psnr --scene "$work/desk-262" --proxy truth
table 'Fig. 6-3: angles by vanishing points against true ones' "$bin/vanishing_point_bench" "$work/desk-262" --proxy plane -o "$work/figure-6-3"
if [ ! -d "$work/fox" ] && [ -n "$data" ] && [ -d "$data/fox" ]; then "$bin/bench_figures" --work "$work" --data "$data" --only fox >/dev/null; fi
if [ -d "$work/fox" ]; then
  for proxy in plane mesh; do table "The same: fox, $proxy" "$bin/sparse_blend_bench" psnr --scene "$work/fox" --proxy "$proxy"; done
fi
if [ -n "$data" ] && [ -d "$data/knights" ]; then
  if [ ! -d "$work/knights" ]; then
    # A rectified camera grid: places from the files' names, a focal length that nothing tells.
    "$bin/lumi-reconstruct" "$data/knights/images" -o "$work/knights" --rig grid
    "$bin/lumi-proxy" auto "$work/knights"
  fi
  table 'The same: knights, plane' "$bin/sparse_blend_bench" psnr --scene "$work/knights" --proxy plane
  table 'Held out: knights' "$bin/lumi-render" "$work/knights" --holdout 8
fi
if [ -f "$work/desk-capture/truth/mesh.ply" ]; then
  for scale in 0.8 1.05 1.2 1.3; do
    table "A mesh at $scale times its size, aligned by ICP" "$bin/lumi-proxy" import "$work/desk-capture/truth/mesh.ply" "$work/desk-capture" --name by-icp --scale "$scale" --align icp
  done
fi
scenes=()
for s in fountain desk; do [ ! -d "$work/$s/proxies" ] || scenes+=("$work/$s"); done
table 'A proxy of each view: milliseconds beside CGAL and OpenCV' "$bin/view_triangulation_bench" --scene ${scenes[@]+"${scenes[@]}"}
for s in ${scenes[@]+"${scenes[@]}"}; do
  table "What auto measures: ${s##*/}" "$bin/lumi-proxy" auto "$s"
  table "The fly-through, 960 px wide: ${s##*/}" fly_through "$s"
  for proxy in mesh per-view; do table "Held out: ${s##*/}, $proxy, 640 px wide" "$bin/lumi-render" "$s" --proxy "$proxy" --holdout 8 --width 640; done
done
table 'The nine properties of Table 3.2: desk, plane' "$bin/lumi-render" properties "$work/desk-262" --proxy plane
for example in car person; do table "lumi-proxy simplify --tradeoff: $example" simplified "$example"; done
