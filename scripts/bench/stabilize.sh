#!/usr/bin/env bash
# Stabilisation: simulated walks, and below --data the shaky videos, beside vid.stab's results
# Programs: lumi-pipeline lumi-reconstruct lumi-render lumi-simulate lumi-stabilize stabilize_bench steady_path_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

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
    heading "$example, $model, against the ideal path"
    printf '```\n'
    "$bin/steady_path_bench" "$(shaky_walk $example)" "$folder/$model-work/window-000/scene" "$folder/$model-work/window-000/path.json" "$folder/$model.mp4" "$work/steady-$example/video.mp4" "${object[@]}"
    printf '```\n'
  done
}
stabilisation() {
  "$bin/stabilize_bench"
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
stabilisation
