#!/usr/bin/env bash
# Makes the thesis's figures 4-3 to 5-13 on simulated captures: pictures, false colours, tessellations, differences, tables and
# plots, with an index.html over them. docs/thesis-figures.md says where we differ, and why.
#
#   scripts/thesis-figures.sh OUT                all of them: 262 desk photos, 480 of the plaza, 219 of the hallway, 36 of the car
#   scripts/thesis-figures.sh OUT --quick        a look in a few minutes: 60 photos a scene, 240 pixels wide
#     --views N  at most N photos a scene    --width W  of photos and figures, pixels (640; the hallway's photos are 320)
#     --only SCENE  desk, plaza, hallway, car or person; may be given again    --backend cpu|gl    --threads N
#     --bin DIR  programs that are built already; default: build/release/bin, built first
# Captures stay in OUT/captures: a second run renders again without photographing again.
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/common.sh

out='' views=100000 width=640 backend=cpu threads=0 bin='' only=() quick=''
number() {
  if ! [[ $2 =~ ^[0-9]{1,6}$ ]] || [ "$2" -lt "$3" ]; then die "$1 takes a whole number from $3; not $2" 2; fi
}
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' scripts/thesis-figures.sh; exit 0 ;;
    --quick) quick=1; views=60 width=240; shift ;;
    --views | --width | --only | --backend | --threads | --bin)
      [ $# -ge 2 ] || die "$1 needs a value" 2
      case $1 in
        --views) number "$1" "$2" 4; views=$2 ;;
        --width) number "$1" "$2" 16; width=$2 ;;
        --threads) number "$1" "$2" 0; threads=$2 ;;
        --only) [[ $2 =~ ^(desk|plaza|hallway|car|person)$ ]] || die "--only takes desk, plaza, hallway, car or person; not $2" 2; only+=("$2") ;;
        --backend) [[ $2 =~ ^(cpu|gl)$ ]] || die "--backend takes cpu or gl; not $2" 2; backend=$2 ;;
        --bin) case $2 in /*) bin=$2 ;; *) bin=$start_folder/$2 ;; esac ;;
      esac
      shift 2 ;;
    -*) die "$1 is no option (see --help)" 2 ;;
    *) [ -z "$out" ] || die "one folder is wanted, not also $1" 2
      case $1 in /*) out=$1 ;; *) out=$start_folder/$1 ;; esac
      shift ;;
  esac
done
[ -n "$out" ] || die "say into which folder (see --help)" 2
[ ${#only[@]} -gt 0 ] || only=(desk plaza hallway car person)
if [ -z "$bin" ]; then
  install_packages
  build release lumi-simulate lumi-proxy lumi-render
  bin=$PWD/build/release/bin
fi
views_folder=$PWD/scripts/thesis-figures
mkdir -p "$out"
parts=$out/.parts
rm -rf "$parts"
mkdir -p "$parts"
trap 'rm -rf "$parts"' EXIT

wanted() { [[ " ${only[*]} " == *" $1 "* ]]; }
least() { echo $(($1 < $2 ? $1 : $2)); }
quietly() { "$@" --quiet --threads "$threads"; }

# capture SCENE PHOTOS WIDTH: once.
capture() {
  say "$1: $(least "$2" "$views") photos, $(least "$3" "$width") pixels wide"
  quietly "$bin/lumi-simulate" --replace --example "$1" -o "$out/captures/$1" --views "$(least "$2" "$views")" --width "$(least "$3" "$width")"
}

# section ID "Fig. ..." "caption": what follows stands below it. Pictures in rows of the table that `row` begins.
page=''
section() { page=$parts/$1.html; printf '<h2 id="%s">%s</h2><p>%s</p>\n' "$1" "$2" "$3" >"$page"; }
note() { printf '<p class="note">%s</p>\n' "$1" >>"$page"; }
open_row() { printf '<div class="row">\n' >>"$page"; }
close_row() { printf '</div>\n' >>"$page"; }
show_file() { printf '<figure><img src="%s" alt="%s"><figcaption>%s</figcaption></figure>\n' "$1" "$2" "$2" >>"$page"; }

# picture FILE "caption" SCENE PROXY VIEW OPTIONS...: VIEW is the name of a camera path beside this script, or photo:NAME.
# What a build cannot do yet is said on the page, and the rest goes on.
picture() {
  local file=$1 caption=$2 scene=$out/captures/$3 proxy=$4 view=$5 work=$out/.work made reason
  shift 5
  rm -rf "$work"
  local where=(--path "$views_folder/$view.json")
  [[ $view != photo:* ]] || where=(--view "${view#photo:}" --leave-out)
  if ! reason=$(quietly "$bin/lumi-render" "$scene" -o "$work" --proxy "$proxy" "${where[@]}" --width "$width" --backend "$backend" "$@" 2>&1); then
    say "$file: $reason"
    printf '<figure class="missing"><div>%s</div><figcaption>%s</figcaption></figure>\n' "$(html "$reason")" "$caption" >>"$page"
    rm -rf "$work"
    return
  fi
  made=$(find "$work" -name '*.png' | sort | head -n 1)
  mv "$made" "$out/$file.png"
  rm -rf "$work"
  show_file "$file.png" "$caption"
}
html() { sed 's/&/\&amp;/g; s/</\&lt;/g; s/>/\&gt;/g' <<<"$1"; }

# both FILE "caption" ...: the picture, and its false colours.
both() {
  local file=$1 caption=$2
  shift 2
  picture "$file" "$caption" "$@"
  picture "$file-false-color" "$caption: false colours" "$@" --show false-color
}

optimum=(--similarity full --grid pixel --visibility off)

desk() {
  capture desk 262 640
  quietly "$bin/lumi-proxy" plane "$out/captures/desk"
  local d=(desk plane desk)
  section fig-4-3 'Figure 4-3: the camera configuration' 'Photos in blue, the virtual view in red, the plane proxy in grey.'
  open_row; picture fig-4-3 'from above, from the side, obliquely' "${d[@]}" --show cameras; close_row
  section fig-4-4 'Figure 4-4: the optimum, by angle alone' 'Every pixel solves for all cameras that correlate with it. A photo that ends leaves a hole.'
  open_row; both fig-4-4 'angle' "${d[@]}" "${optimum[@]}" --fov off --resolution off; close_row
  section fig-4-8 'Figure 4-8: with field of view' 'Alpha 0.5, gamma 1: around the border, photos that see the place fill in.'
  open_row; both fig-4-8 'angle and field of view' "${d[@]}" "${optimum[@]}" --alpha 0.5 --gamma 1 --fov on --resolution off; close_row
  section fig-4-9 'Figure 4-9: with resolution' 'Alpha 0.5, beta 1: cameras that are farther away lose their epipoles.'
  open_row; both fig-4-9 'angle and resolution' "${d[@]}" "${optimum[@]}" --alpha 0.5 --beta 1 --fov off --resolution jacobian --resolution-range 0.33,3; close_row
  section fig-5-3 'Figure 5-3: one optimisation after the other' 'The optimum; the similarity matrix as the identity; resolution by distance; the 5 nearest; 25x25 samples; and our candidates.'
  quietly "$bin/lumi-render" tradeoff --ablation "$out/captures/desk" -o "$out/fig-5-3" --proxy plane --path "$views_folder/desk.json" --width "$width" --backend "$backend" --fov off
  note '<a href="fig-5-3/index.html">The rows with their differences</a>, <a href="fig-5-3/ablation.csv">as a table</a>'
  local stem
  for stem in "$out"/fig-5-3/*-false-color.png; do
    stem=$(basename "${stem%-false-color.png}")
    open_row
    show_file "fig-5-3/$stem.png" "${stem#*-}"
    show_file "fig-5-3/$stem-false-color.png" "${stem#*-}: false colours"
    show_file "fig-5-3/$stem-difference.png" "${stem#*-}: difference from the first row, times 4"
    close_row
  done
  section fig-5-4 'Figure 5-4: what sparse samples cost' 'Squared error against a weight a pixel, over samples a side, with and without epipoles; and accuracy against time.'
  quietly "$bin/lumi-render" tradeoff "$out/captures/desk" -o "$out/fig-5-4" --proxy plane --width "$width" --reference-width "$(least 320 "$width")" --path "$views_folder/desk.json" --backend "$backend" --views 2 ${quick:+--quick}
  open_row; show_file fig-5-4/figure-5-4.svg 'Figure 5-4'; close_row
  open_row; show_file fig-5-4/tradeoff.svg 'accuracy against time'; close_row
  note '<a href="fig-5-4/tradeoff.csv">All points</a>'
}

plaza() {
  capture plaza 480 640
  quietly "$bin/lumi-proxy" import "$views_folder/plaza.obj" "$out/captures/plaza" --name planes
  local v sparse=(--grid 25x25 --sampling interpolated --k 5)
  section fig-5-5 'Figure 5-5: a hand-held walk' 'Two planes as proxy. Left to right: the configuration, the picture, false colours, the 25x25 tessellation. Field of view is ignored.'
  for v in plaza-near plaza-far; do
    open_row
    picture "fig-5-5-$v-cameras" "${v#*-}: cameras" plaza planes $v --show cameras
    both "fig-5-5-$v" "${v#*-}" plaza planes $v "${sparse[@]}" --fov off --visibility off
    picture "fig-5-5-$v-tessellation" "${v#*-}: tessellation" plaza planes $v "${sparse[@]}" --fov off --visibility off --show tessellation
    close_row
  done
  quietly "$bin/lumi-proxy" planes "$out/captures/plaza" --name found --tolerance 0.04
  section proxies-plaza 'Proxies found: the plaza' 'Two quads that lumi-proxy planes finds in the points: ground and backdrop, joined at their crease.'
  shown proxy-plaza 'plaza' plaza found plaza-far
  section fig-5-6 'Figure 5-6: with field of view' 'The same views with gamma 1.'
  for v in plaza-near plaza-far; do
    open_row; both "fig-5-6-$v" "${v#*-}" plaza planes $v "${sparse[@]}" --fov on --gamma 1 --visibility off; close_row
  done
}

# shown FIGURE "caption" SCENE PROXY VIEW: the proxy, flat-shaded, and the picture over it.
shown() {
  open_row
  picture "$1-proxy" "$2: the proxy" "$3" "$4" "$5" --show proxy
  picture "$1" "$2" "$3" "$4" "$5"
  close_row
}

hallway() {
  capture hallway 219 320
  quietly "$bin/lumi-proxy" import "$views_folder/hallway.obj" "$out/captures/hallway" --name tube
  quietly "$bin/lumi-proxy" import "$views_folder/hallway-open.obj" "$out/captures/hallway" --name tube-open
  local v sparse=(--grid 25x25 --sampling interpolated --k 5 --visibility off)
  section fig-5-8 'Figure 5-8: down the hallway' 'A tube of six sides as proxy. Two sets of circles: cameras before the view, and behind it.'
  for v in hallway-middle hallway-turned; do
    open_row
    both "fig-5-8-$v" "${v#*-}" hallway tube $v "${sparse[@]}" --resolution off
    picture "fig-5-8-$v-tessellation" "${v#*-}: tessellation" hallway tube $v "${sparse[@]}" --resolution off --show tessellation
    close_row
  done
  quietly "$bin/lumi-proxy" box "$out/captures/hallway" --name found
  section proxies-hallway 'Proxies found: the hallway' 'The tube that lumi-proxy box fits around the cameras and points.'
  shown proxy-hallway 'hallway' hallway found hallway-middle
  section fig-5-9 'Figure 5-9: from where no camera can stand' 'From behind the left wall, which the proxy leaves out. Above without field of view, below with it.'
  for v in off on; do
    open_row; both "fig-5-9-fov-$v" "field of view $v" hallway tube-open hallway-outside "${sparse[@]}" --resolution off --fov $v; close_row
  done
  section fig-5-10 'Figure 5-10: resolution' 'The orange paper on the left wall. Above without the resolution measure, below with it (by distance, beta 1).'
  for v in off distance; do
    open_row; both "fig-5-10-resolution-$v" "resolution $v" hallway tube hallway-wall "${sparse[@]}" --resolution $v --beta 1; close_row
  done
  section fig-5-11 'Figure 5-11: against photos that were left out' 'The photo, the picture from all others, their absolute difference times 4.'
  local names n i
  mapfile -t names < <(find "$out/captures/hallway/images" -type f -printf '%f\n' | sort)
  n=${#names[@]}
  for i in 1 2 3; do
    v=${names[$((i * n / 4))]}
    cp "$out/captures/hallway/images/$v" "$out/fig-5-11-$i-photo.${v##*.}"
    open_row
    show_file "fig-5-11-$i-photo.${v##*.}" "$v"
    picture "fig-5-11-$i" 'rendered without it' hallway tube "photo:$v" "${sparse[@]}" --resolution distance
    picture "fig-5-11-$i-difference" 'difference' hallway tube "photo:$v" "${sparse[@]}" --resolution distance --show difference
    close_row
  done
}

car() {
  capture car 36 640
  local v proxy=truth sparse
  # The thesis's proxy is a visual hull of 500 faces; where this build makes none, the true surface stands in.
  if quietly "$bin/lumi-proxy" hull "$out/captures/car" --silhouettes "$out/captures/car/truth/silhouettes" 2>/dev/null &&
    quietly "$bin/lumi-proxy" simplify "$out/captures/car" --faces 500 --keep-hull --name hull-500 2>/dev/null; then
    proxy=hull-500
  fi
  sparse=(--grid 2x2 --sampling interpolated --k 4)
  section fig-5-12 'Figure 5-12: 36 photos of a car' "Proxy: $proxy. Weights are sampled at the mesh's vertices and where a triangle is larger than a cell."
  for v in car-front car-rear; do
    open_row
    picture "fig-5-12-$v-cameras" "${v#*-}: cameras" car $proxy $v --show cameras
    both "fig-5-12-$v" "${v#*-}" car $proxy $v "${sparse[@]}"
    picture "fig-5-12-$v-tessellation" "${v#*-}: tessellation" car $proxy $v "${sparse[@]}" --show tessellation
    close_row
  done
  section proxies-car 'Proxies found: the car in 500 faces' 'The visual hull of its 36 silhouettes, simplified so that it stays around them.'
  shown proxy-car 'car' car $proxy car-front
  section fig-5-13 'Figure 5-13: the silhouette' 'The picture'\''s contour comes from the photos (left), not from the geometry (right).'
  open_row
  picture fig-5-13 'a close-up' car $proxy car-roof "${sparse[@]}"
  picture fig-5-13-tessellation 'the same with the triangles of the proxy' car $proxy car-roof "${sparse[@]}" --show tessellation
  close_row
}

person() {
  capture person 4 480
  quietly "$bin/lumi-proxy" hull "$out/captures/person" --silhouettes "$out/captures/person/truth/silhouettes"
  local photos first second
  mapfile -t photos < <(find "$out/captures/person/images" -type f -printf '%f\n' | sort)
  first=${photos[0]} second=${photos[1]}
  section fig-5-14 'Figure 5-14: a person from four silhouettes' 'The visual hull, flat-shaded, at two photos'"'"' cameras.'
  open_row
  picture fig-5-14-a 'the hull' person hull "photo:$first" --show proxy
  picture fig-5-14-b 'from another side' person hull "photo:$second" --show proxy
  close_row
  section fig-5-15 'Figure 5-15: the hull with the photos on it' 'At the first photo'"'"'s camera, without that photo: three photos are left.'
  open_row
  both fig-5-15 'rendered' person hull "photo:$first"
  close_row
}

for scene in desk plaza hallway car person; do
  if wanted $scene; then $scene; fi
done

{
  cat <<'HEAD'
<!doctype html><html lang="en"><meta charset="utf-8"><title>The thesis's figures</title>
<style>body{font:15px/1.45 system-ui,sans-serif;margin:2rem auto;max-width:1500px;padding:0 1rem;color:#24292f}h2{margin:2.2rem 0 0}p{margin:.3rem 0 .8rem}
.row{display:flex;flex-wrap:wrap;gap:12px;margin-bottom:12px}figure{margin:0;flex:1 1 280px;max-width:100%}img{width:100%;display:block;background:repeating-conic-gradient(#eee 0 25%,#fff 0 50%) 0 0/16px 16px}
figcaption{font-size:12px;color:#6a737d}.missing div{border:1px dashed #9aa4ae;padding:1rem;font-size:12px}</style>
<h1>Rendering from unstructured collections of images: the thesis's figures</h1>
<p>Buehler 2002, chapters 4 and 5, on simulated captures. docs/thesis-figures.md says where these differ from the originals, and why.</p>
HEAD
  for id in fig-4-3 fig-4-4 fig-4-8 fig-4-9 fig-5-3 fig-5-4 fig-5-5 fig-5-6 fig-5-8 fig-5-9 fig-5-10 fig-5-11 fig-5-12 fig-5-13 proxies-plaza proxies-hallway proxies-car proxies-person; do
    [ ! -f "$parts/$id.html" ] || cat "$parts/$id.html"
  done
  echo '</html>'
} >"$out/.index.html"
mv "$out/.index.html" "$out/index.html"
say "$out/index.html"
