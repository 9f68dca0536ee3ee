#!/usr/bin/env bash
# Shows whether a change of the program changed what it renders: six scenes are made once and kept, a build renders them by every
# method and backend, and the pictures of two builds are compared.
#
#   scripts/stored-renders.sh scenes SCENES          makes the scenes; those that are there stay
#   scripts/stored-renders.sh render SCENES OUT      renders them: a picture and its summary (.json) each, lossless
#   scripts/stored-renders.sh help OUT               keeps --help of every program and of its subcommands
#   scripts/stored-renders.sh at COMMIT SCENES OUT   builds COMMIT outside of the repository, in OUT.build, then help and render
#   scripts/stored-renders.sh compare OLD NEW        a row for each picture that differs; exit code 1 where one differs too much
#
#   --bin DIR         programs that are built already; default: build/release/bin
#   --data DIR        captures for `scenes`; default: ../shared/data. Scenes whose capture is absent are skipped, and it is said
#   --only SCENE      desk, fox, knights, lamp, projective or hull; may be given again
#   --methods REGEX   render: only the methods whose names match, beside the pictures that are there
#   --jobs N          programs at once, each with one thread; default: as many as there are cores
#   --tolerance N     compare: code values by which a byte may differ; default: 1, and 2 of pictures that OpenGL made
#   --share S         compare: share of a picture's bytes that may differ by more; default: 0.0001, and 0 of pictures that OpenGL made
#   --figures F       compare: by how much a summary's number may differ, relative where it is above 1; default: 0.001
#   --all             compare: also a row for each picture that does not differ
#
# desk (simulated, true mesh), fox (photos, a mesh through their points), knights (a grid of cameras, a plane), lamp (repeats itself
# in time), projective (a video's cameras without a metric, along a stabilised path) and hull (a turntable's silhouettes).
# A method that the program refuses is kept as its message (.txt). Times and the device in a summary are not kept.
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/common.sh
me=$PWD/scripts/stored-renders.sh

bin=$PWD/build/release/bin data=$PWD/../shared/data only=() jobs=$(nproc) tolerance='' share='' figures=0.001 chosen='' every='' words=()
from_start() { case $1 in /*) echo "$1" ;; *) echo "$start_folder/$1" ;; esac; }
number() { [[ $2 =~ ^[0-9]+(\.[0-9]+)?(e-?[0-9]+)?$ ]] || die "$1 takes a number, not $2" 2; }
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,25s/^# \{0,1\}//p' "$me"; exit 0 ;;
    --all) every=1; shift ;;
    --bin | --data | --only | --methods | --jobs | --tolerance | --share | --figures)
      [ $# -ge 2 ] || die "$1 needs a value" 2
      case $1 in
        --bin) bin=$(from_start "$2") ;;
        --data) data=$(from_start "$2") ;;
        --only) [[ $2 =~ ^(desk|fox|knights|lamp|projective|hull)$ ]] || die "--only takes desk, fox, knights, lamp, projective or hull; not $2" 2; only+=("$2") ;;
        --methods) chosen=$2 ;;
        --jobs) [[ $2 =~ ^[1-9][0-9]{0,2}$ ]] || die "--jobs takes a whole number from 1; not $2" 2; jobs=$2 ;;
        --tolerance) number "$1" "$2"; tolerance=$2 ;;
        --share) number "$1" "$2"; share=$2 ;;
        --figures) number "$1" "$2"; figures=$2 ;;
      esac
      shift 2 ;;
    -*) die "$1 is no option (see --help)" 2 ;;
    *) words+=("$1"); shift ;;
  esac
done
[ ${#only[@]} -gt 0 ] || only=(desk fox knights lamp projective hull)
command=${words[0]:-}
folders() { [ ${#words[@]} -eq $(($1 + 1)) ] || die "$command takes $1 names (see --help)" 2; }
programs() {
  local p
  for p in "$@"; do [ -x "$bin/$p" ] || die "there is no $bin/$p: build it, or name its folder with --bin" 2; done
}
quietly() { "$@" --quiet >/dev/null; }

# --- scenes ---

# Every STEP-th photo of a capture's folder, linked.
some_photos() {
  local folder=$1 step=$2 i=0 photo
  mkdir -p photos
  for photo in "$folder"/*; do
    [ $((i++ % step)) -ne 0 ] || ln -s "$(realpath "$photo")" photos/
  done
}
# Each is made in the working folder, as ./scene.
make_desk() {
  quietly "$bin/lumi-simulate" --example desk --views 24 --width 640 -o scene
  quietly "$bin/lumi-proxy" plane scene
}
make_fox() {
  mkdir photos
  local photo i=0
  for photo in "$data"/fox/images/*.jpg; do  # half as large: full-size photos would take most of the time
    [ $((i++ % 2)) -ne 0 ] || ffmpeg -nostdin -loglevel error -i "$photo" -vf scale=540:960:flags=area -q:v 2 "photos/${photo##*/}"
  done
  quietly "$bin/lumi-reconstruct" photos -o scene --poses "$data/fox/transforms.json" --rescale-cameras --max-features 1000
  quietly "$bin/lumi-proxy" delaunay scene
}
make_knights() {
  mkdir photos
  local row column
  for row in 04 06 08 10 12; do
    for column in 04 06 08 10 12; do ln -s "$(realpath "$data"/knights/images/out_${row}_${column}_*)" photos/; done
  done
  quietly "$bin/lumi-reconstruct" photos -o scene --rig grid
  quietly "$bin/lumi-proxy" plane scene
}
make_lamp() { quietly "$bin/lumi-simulate" --example lamp --views 320 --width 192 --fixed-frames 0 -o scene; }
make_projective() {
  quietly "$bin/lumi-simulate" --example plaza --video --views 60 --width 320 --shake 1.5 -o capture
  quietly "$bin/lumi-reconstruct" capture/video.mp4 -o scene --backend factorization --projective --all-frames
  quietly "$bin/lumi-stabilize" scene -o path.json --model smooth
  # Two of its keys are enough.
  awk 'BEGIN { RS = "},{\"time_s\""; ORS = "" } NR == 1 { sub(/\[\{"time_s".*/, "["); print; separator = "" }
       NR == 21 || NR == 41 { sub(/\}\]\}.*/, ""); print separator "{\"time_s\"" $0 "}"; separator = "," } END { print "]}\n" }' path.json >scene/stored-path.json
}
make_hull() {
  some_photos "$data/dinosaur/images" 2
  quietly "$bin/lumi-reconstruct" photos -o scene --poses "$data/dinosaur/dino_P.txt" --poses-format projection --quality low
  quietly "$bin/lumi-proxy" silhouettes scene --rule '(B - R) < 25 && R + G + B > 60'
  quietly "$bin/lumi-proxy" hull scene --cell-px 4
  quietly "$bin/lumi-proxy" simplify scene --faces 500 --keep-hull --name hull-500
}
scenes() {
  local out=$1 scene capture seconds
  programs lumi-simulate lumi-reconstruct lumi-proxy lumi-stabilize
  mkdir -p "$out"
  out=$(cd "$out" && pwd)
  for scene in "${only[@]}"; do
    case $scene in fox | knights) capture=$scene ;; hull) capture=dinosaur ;; *) capture='' ;; esac
    if [ -d "$out/$scene" ]; then say "$scene: is there"; continue; fi
    if [ -n "$capture" ] && [ ! -d "$data/$capture" ]; then say "$scene: skipped, there is no $data/$capture"; continue; fi
    seconds=$SECONDS
    rm -rf "$out/.making"
    mkdir "$out/.making"
    (cd "$out/.making" && "make_$scene") || die "$scene could not be made" 1
    mv "$out/.making/scene" "$out/$scene"
    rm -rf "$out/.making"
    say "$scene: made in $((SECONDS - seconds)) s"
  done
}

# --- render ---

# What is rendered of a scene: name, backends, options. `at` is where the picture is seen from.
methods() {
  local at=$1 path=$2
  cat <<METHODS
default cpu,gl $at
own-camera cpu ${at% --leave-out}
k1 cpu,gl $at --k 1
k-all cpu,gl $at --k all
falling-leaves cpu,gl $at --correlation falling-leaves
falling-leaves-k-all cpu $at --correlation falling-leaves --k all
optimum cpu $at --similarity full
optimum-samples cpu,gl $at --similarity full --grid 24x18
interpolated cpu,gl $at --grid 24x18 --sampling interpolated
candidates cpu,gl $at --grid 24x18 --sampling candidates
false-color cpu,gl $at --show false-color
tessellation cpu,gl $at --show tessellation --grid 24x18
proxy cpu $at --show proxy
weights cpu $at --show weights
along-a-path cpu,gl $path
METHODS
}
# More on the desk and what a method of its own shows; the other scenes have what is particular to them.
methods_of_desk() {
  local at='--view desk_0125.jpg --leave-out' path="--path $PWD/scripts/thesis-figures/desk.json" m
  methods "$at" "$path"
  for m in angle fov resolution visibility time dissimilarity difference cameras; do echo "show-$m cpu $at --show $m"; done
  cat <<METHODS
show-weights-of cpu $at --show weights --of desk_0148.jpg
k2 cpu,gl $at --k 2
k16 cpu,gl $at --k 16
optimum-renormalise cpu,gl $at --similarity full --sum renormalise --grid 24x18
optimum-constrained cpu,gl $at --similarity full --sum constrained --grid 24x18
optimum-renormalise-pixel cpu $at --similarity full --sum renormalise
optimum-constrained-pixel cpu $at --similarity full --sum constrained
optimum-additive cpu $at --similarity full --combine additive
optimum-cutoff cpu $at --similarity full --cutoff-deg 8
optimum-accuracy cpu $at --similarity full --accuracy 1e-6 --grid 24x18
optimum-leaves cpu $at --similarity full --r-min-deg 0.5 --r-max-deg 10
optimum-jacobian cpu $at --similarity full --resolution jacobian
optimum-false-color cpu $at --similarity full --show false-color
interpolated-k-all cpu,gl $at --grid 24x18 --sampling interpolated --k all
interpolated-falling-leaves cpu,gl $at --grid 24x18 --sampling interpolated --correlation falling-leaves
interpolated-false-color cpu,gl $at --grid 24x18 --sampling interpolated --show false-color
candidates-false-color cpu,gl $at --grid 24x18 --sampling candidates --show false-color
epipoles-off cpu,gl $at --grid 24x18 --sampling interpolated --epipoles off
resolution-distance cpu,gl $at --resolution distance
resolution-jacobian cpu,gl $at --resolution jacobian --beta 2
resolution-range cpu,gl $at --resolution jacobian --resolution-range 0.2,2
visibility-off cpu,gl $at --visibility off
fov-off cpu,gl $at --fov off
fov-feather cpu,gl $at --fov-feather 0.3 --gamma 3
prefilter-off cpu,gl $at --prefilter off
exposure-on cpu,gl $at --exposure on
effects-none cpu,gl $at --effects none
alpha cpu,gl $at --alpha 0.4 --resolution distance
optimum-refused gl $at --similarity full
plane cpu,gl $at --proxy plane
per-view cpu,gl $at --proxy per-view
per-view-interpolated cpu,gl $at --proxy per-view --grid 24x18 --sampling interpolated
per-view-false-color cpu,gl $at --proxy per-view --show false-color
per-view-proxy cpu $at --proxy per-view --show proxy
path-cameras cpu $path --show cameras
path-optimum cpu $path --similarity full
path-false-color cpu,gl $path --show false-color
path-candidates cpu,gl $path --grid 32x24 --sampling candidates
path-falling-leaves cpu,gl $path --correlation falling-leaves
path-k-all cpu,gl $path --k all
path-visibility-off cpu,gl $path --visibility off
path-resolution-jacobian cpu,gl $path --resolution jacobian --beta 2
path-optimum-false-color cpu $path --similarity full --show false-color
path-optimum-samples cpu,gl $path --similarity full --grid 24x18
path-interpolated cpu,gl $path --grid 32x24 --sampling interpolated --k 5 --fov off
held-out cpu,gl --holdout 8
held-out-choose cpu --holdout 8 --fold choose --similarity full --grid 24x18
held-out-per-view cpu --holdout 8 --proxy per-view
METHODS
}
methods_of_fox() {
  local at='--view 0027.jpg --leave-out'
  methods "$at" '--seconds 1 --fps 2'
  cat <<METHODS
visibility-off cpu,gl $at --visibility off
exposure-off cpu,gl $at --exposure off
prefilter-off cpu,gl $at --prefilter off
resolution-jacobian cpu,gl $at --resolution jacobian
per-view cpu,gl $at --proxy per-view
show-visibility cpu $at --show visibility
held-out cpu,gl --holdout 8
METHODS
}
methods_of_knights() {
  local at
  at="--view $(cd "$scene_folder/images" && echo out_08_08_*) --leave-out"
  methods "$at" '--seconds 1 --fps 2'
  cat <<METHODS
leaves-wide cpu $at --similarity full --r-max-deg 20
held-out cpu,gl --holdout 8
METHODS
}
methods_of_lamp() {
  local at='--view lamp_0200.jpg --leave-out'
  methods "$at" '--seconds 1 --fps 2'
  cat <<METHODS
time-off cpu,gl $at --time off
phase cpu,gl --view lamp_0040.jpg --phase 0.3
time-s cpu,gl --view lamp_0040.jpg --time-s 3.2
window cpu,gl $at --time-window-s 0.5 --time-core 0 --time-least 0.1
epsilon cpu,gl $at --epsilon 0.2
optimum-time-off cpu $at --similarity full --time off
show-time cpu $at --show time
truth cpu,gl $at --proxy truth
held-out cpu --holdout 20
METHODS
}
methods_of_projective() {
  local at="--path $scene_folder/stored-path.json"
  methods "$at" '--view frame_000030.jpg --leave-out'
  cat <<METHODS
fill cpu,gl $at --border fill --fill-frames 20
window-all cpu,gl $at --window-frames all
window-2 cpu $at --window-frames 2
nominal-focal cpu,gl $at --nominal-focal-px 200
resolution-jacobian cpu,gl $at --resolution jacobian
time-core cpu $at --time-core 0.5
show-angle cpu $at --show angle
show-time cpu $at --show time
held-out cpu,gl --holdout 12
METHODS
}
methods_of_hull() {
  local at='--view viff010.jpg --leave-out'
  methods "$at" '--seconds 1 --fps 2'
  cat <<METHODS
hull-500 cpu,gl $at --proxy hull-500
hull-500-interpolated cpu,gl $at --proxy hull-500 --grid 2x2 --sampling interpolated
hull-500-tessellation cpu,gl $at --proxy hull-500 --grid 2x2 --sampling interpolated --show tessellation
visibility-off cpu,gl $at --visibility off
show-visibility cpu $at --show visibility
show-fov cpu $at --show fov
held-out cpu,gl --holdout 6
METHODS
}

# A line of `methods`, of one backend: its pictures and summary, or the message with which it was refused.
one() {
  local scene name backend options scenes=$2 out=$3 work status=0 picture frame
  read -r scene name backend options <<<"$1"
  work=$(mktemp -d "$out/.work-XXXXXX")
  local stem=$out/$scene/$name.$backend
  # Most of Mesa's time would go into optimising shaders that draw a few small pictures.
  # shellcheck disable=SC2086
  GALLIVM_PERF=nopt "$bin/lumi-render" "$scenes/$scene" -o "$work/out" $options --width 240 --backend "$backend" --threads 1 --json --quiet >"$work/summary.json" 2>"$work/message" || status=$?
  if [ $status -eq 0 ]; then
    grep -v '"\(device\|[a-z_]*ms\|ms_per_frame\|[a-z_]*seconds\)":' "$work/summary.json" >"$stem.json"
    [[ $options == *--holdout* ]] || while read -r picture; do
      frame=${picture##*/frame_}
      if [ "$frame" = "$picture" ]; then mv "$picture" "$stem.png"; else mv "$picture" "$stem.$((10#${frame%.png})).png"; fi
    done < <(find "$work/out" -name '*.png')
  elif [ $status -le 4 ]; then
    { echo "exit code $status"; sed "s|$work|OUT|g; s|$scenes|SCENES|g" "$work/message"; } >"$stem.txt"
  else
    { echo "$scene $name $backend: exit code $status"; cat "$work/message"; } >>"$out/failed"
  fi
  rm -rf "$work"
}
render() {
  local scenes=$1 out=$2 scene name backends options backend seconds=$SECONDS
  programs lumi-render
  [ -d "$scenes" ] || die "$scenes is no folder: make it by $0 scenes" 2
  scenes=$(cd "$scenes" && pwd)
  mkdir -p "$out"
  out=$(cd "$out" && pwd)
  rm -f "$out/failed" "$out/list"
  for scene in "${only[@]}"; do
    scene_folder=$scenes/$scene
    if [ ! -d "$scene_folder" ]; then say "$scene: skipped, there is no $scene_folder"; continue; fi
    [ -n "$chosen" ] || rm -rf "${out:?}/$scene"
    mkdir -p "$out/$scene"
    while read -r name backends options; do
      [[ $name =~ $chosen ]] || continue
      for backend in ${backends//,/ }; do echo "$scene $name $backend $options"; done
    done < <("methods_of_$scene") >>"$out/list"
  done
  export -f one
  export bin
  xargs -a "$out/list" -d '\n' -P "$jobs" -I{} bash -c 'one "$@"' _ {} "$scenes" "$out"
  say "$(find "$out" -name '*.png' | wc -l) pictures of $(wc -l <"$out/list") renderings, $(find "$out" -name '*.txt' -not -path '*/help/*' | wc -l) refused, in $((SECONDS - seconds)) s: $out"
  rm "$out/list"
  [ ! -f "$out/failed" ] || { cat "$out/failed" >&2; die "these failed" 1; }
}

# --- help ---

help_of_all() {
  local out=$1 p sub name
  mkdir -p "$out"
  for p in "$bin"/lumi-*; do
    name=${p##*/}
    "$p" --help >"$out/$name.txt"
    awk '/^Subcommands:/ { on = 1; next } on && /^  [a-z]/ { print $1 }' "$out/$name.txt" | while read -r sub; do
      "$p" "$sub" --help >"$out/$name-$sub.txt"
    done
  done
  say "$(find "$out" -name '*.txt' | wc -l) pages of help: $out"
}

# --- compare ---

# "largest difference, bytes that differ by more than $3, bytes" of two pictures' pixels.
pixel_difference() {
  local work=$4
  cmp -s "$1" "$2" && { echo "0 0 1"; return; }
  rm -f "$work"/[ab].raw
  ffmpeg -nostdin -y -loglevel error -i "$1" -i "$2" -map 0 -f rawvideo -pix_fmt rgba "$work/a.raw" -map 1 -f rawvideo -pix_fmt rgba "$work/b.raw" || { echo "255 1 1"; return; }
  if [ "$(stat -c %s "$work/a.raw")" != "$(stat -c %s "$work/b.raw")" ]; then echo "255 1 1"; return; fi
  { cmp -l "$work/a.raw" "$work/b.raw" || true; } | awk -v bound="$3" -v bytes="$(stat -c %s "$work/a.raw")" '
    function value(octal) { return 64 * substr(octal, 1, 1) + 8 * substr(octal, 2, 1) + substr(octal, 3, 1) }
    { d = value(sprintf("%03d", $2)) - value(sprintf("%03d", $3)); if (d < 0) d = -d; if (d > worst) worst = d; if (d > bound) ++over }
    END { print worst + 0, over + 0, bytes }'
}
# Two summaries: each key's values in their order, words alike and numbers within the bound. A key that came anew is no difference.
summary_difference() {
  awk -v bound="$figures" '
    function key(line) { sub(/^ */, "", line); return match(line, /^"[^"]*": /) ? substr(line, 1, RLENGTH) : line ~ /^[\]\[{},]*$/ ? "" : "," }
    { k = key($0); if (k == "") next; sub(/,$/, ""); id = k (++seen[FILENAME, k]) }
    NR == FNR { old[id] = $0; next }
    id in old {
      a = old[id]; b = $0; delete old[id]
      if (a == b) next
      number = "[-+]?[0-9]+([.][0-9]+)?(e[-+]?[0-9]+)?"
      while (match(a, number)) {
        x = substr(a, RSTART, RLENGTH); before = substr(a, 1, RSTART - 1); a = substr(a, RSTART + RLENGTH)
        if (!match(b, number) || substr(b, 1, RSTART - 1) != before) { bad = id; break }
        y = substr(b, RSTART, RLENGTH); b = substr(b, RSTART + RLENGTH)
        d = x - y; if (d < 0) d = -d
        if (k ~ /evidence/) d /= 100  # rounded for people
        size = x < 0 ? -x : x; if (size > 1) d /= size
        if (d > worst) { worst = d; where = id }
      }
      if (a != b && bad == "") bad = id
    }
    END {
      for (id in old) if (bad == "") bad = id
      if (bad != "") { gsub(/[ :]/, "", bad); print "other " bad } else if (worst > bound) { gsub(/[ :]/, "", where); print worst " " where }
    }' "$1" "$2"
}
compare() {
  local old=$1 new=$2 file ours worst over bytes bound allowed verdict bad=0 pictures=0 differ=0 work row
  [ -d "$old" ] || die "$old is no folder" 2
  [ -d "$new" ] || die "$new is no folder" 2
  work=$(mktemp -d)
  # shellcheck disable=SC2064
  trap "rm -rf '$work'" EXIT
  printf '%-58s %8s %12s\n' picture largest 'share over'
  while read -r file; do
    if [ ! -f "$new/$file" ]; then printf '%-58s %s\n' "$file" 'MISSING in the new ones'; bad=$((bad + 1)); continue; fi
    case $file in
      *.png)
        bound=${tolerance:-1} allowed=${share:-0.0001}
        [[ $file != *.gl.* ]] || { bound=${tolerance:-2} allowed=${share:-0}; }
        read -r worst over bytes < <(pixel_difference "$old/$file" "$new/$file" "$bound" "$work")
        pictures=$((pictures + 1))
        [ "$worst" -eq 0 ] || differ=$((differ + 1))
        verdict=$(awk -v o="$over" -v n="$bytes" -v a="$allowed" 'BEGIN { print (o / n > a ? "TOO MUCH" : "") }')
        [ -z "$verdict" ] || bad=$((bad + 1))
        if [ -n "$every" ] || [ "$worst" -ne 0 ]; then printf '%-58s %8s %12s %s\n' "$file" "$worst" "$(awk -v o="$over" -v n="$bytes" 'BEGIN { printf "%.6f", o / n }')" "$verdict"; fi ;;
      *.json)
        row=$(summary_difference "$old/$file" "$new/$file")
        [ -z "$row" ] || { printf '%-58s figures: %s TOO MUCH\n' "$file" "$row"; bad=$((bad + 1)); } ;;
      *)
        cmp -s "$old/$file" "$new/$file" || { printf '%-58s words differ\n' "$file"; diff "$old/$file" "$new/$file" | head -n 20 || true; bad=$((bad + 1)); } ;;
    esac
  done < <(cd "$old" && find . -type f \( -name '*.png' -o -name '*.json' -o -name '*.txt' \) -printf '%P\n' | sort)
  (cd "$new" && find . -type f \( -name '*.png' -o -name '*.json' -o -name '*.txt' \) -printf '%P\n' | sort) | while read -r file; do
    [ -f "$old/$file" ] || printf '%-58s only in the new ones\n' "$file"
  done
  [ $pictures -gt 0 ] || [ $bad -gt 0 ] || [ -n "$(find "$old" -name '*.txt' -print -quit)" ] || die "there is nothing to compare in $old" 2
  say "$pictures pictures compared: $differ differ, $bad beyond the bounds (pictures, summaries and words)"
  [ $bad -eq 0 ]
}

# --- at ---

at() {
  local commit=$1 tree=$3.build
  if [ ! -d "$tree" ]; then
    mkdir -p "$tree"
    git archive "$commit" | tar -x -C "$tree"
  fi
  (cd "$tree" && . scripts/common.sh && build release lumi-calibrate lumi-pipeline lumi-proxy lumi-reconstruct lumi-render lumi-simulate lumi-stabilize lumi-timeperiodic lumi-view)
  bin=$tree/build/release/bin
  help_of_all "$3/help"
  render "$2" "$3"
}

case $command in
  scenes) folders 1; scenes "$(from_start "${words[1]}")" ;;
  render) folders 2; render "$(from_start "${words[1]}")" "$(from_start "${words[2]}")" ;;
  help) folders 1; help_of_all "$(from_start "${words[1]}")" ;;
  at) folders 3; at "${words[1]}" "$(from_start "${words[2]}")" "$(from_start "${words[3]}")" ;;
  compare) folders 2; compare "$(from_start "${words[1]}")" "$(from_start "${words[2]}")" ;;
  *) die "what is to be done: scenes, render, help, at or compare? (see --help)" 2 ;;
esac
