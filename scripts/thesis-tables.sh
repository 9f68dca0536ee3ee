#!/usr/bin/env bash
# Measures the thesis's Table 3.1: eleven properties of this renderer and twelve published methods on simulated captures, as numbers and
# ticks, and their held-out errors and times. docs/methods.md says what each number is.
#
#   scripts/thesis-tables.sh OUT                desk (262 photos), plaza (480), hallway (219), car (36), person (24)
#   scripts/thesis-tables.sh OUT --data DIR     also fox and knights below DIR
#     --quick  60 photos a scene, 240 pixels wide    --only SCENE  one of them; may be given again    --threads N
#     --bin DIR  programs that are built already; default: build/release/bin, built first
#     --continue  what OUT has results of is not measured again
# OUT/table-3-1.md is the table, OUT/SCENE/methods.* a scene's results. Captures stay in OUT/captures.
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/common.sh

out='' data='' quick='' kept='' threads=0 bin='' only=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,11s/^# \{0,1\}//p' scripts/thesis-tables.sh; exit 0 ;;
    --quick) quick=1; shift ;;
    --continue) kept=1; shift ;;
    --data | --only | --threads | --bin)
      [ $# -ge 2 ] || die "$1 needs a value" 2
      case $1 in
        --data) case $2 in /*) data=$2 ;; *) data=$start_folder/$2 ;; esac; [ -d "$data" ] || die "$data is no folder" 2 ;;
        --only) [[ $2 =~ ^(desk|plaza|hallway|car|person|fox|knights)$ ]] || die "--only takes desk, plaza, hallway, car, person, fox or knights; not $2" 2; only+=("$2") ;;
        --threads) [[ $2 =~ ^[0-9]{1,4}$ ]] || die "--threads takes a whole number; not $2" 2; threads=$2 ;;
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
if [ ${#only[@]} -eq 0 ]; then
  only=(desk plaza hallway car person)
  [ -z "$data" ] || only+=(fox knights)
fi
if [ -z "$bin" ]; then
  install_packages
  build release lumi-simulate lumi-proxy lumi-render lumi-reconstruct lumi-pipeline lumi-export
  bin=$PWD/build/release/bin
fi
geometry=$PWD/scripts/thesis-figures
mkdir -p "$out/captures"
quietly() { "$@" --quiet --threads "$threads"; }

# capture SCENE PHOTOS WIDTH
capture() {
  local photos=$2 width=$3
  if [ -n "$quick" ]; then photos=$((photos < 60 ? photos : 60)) width=240; fi
  say "$1: $photos photos, $width pixels wide"
  quietly "$bin/lumi-simulate" --replace --example "$1" -o "$out/captures/$1" --views "$photos" --width "$width"
}
# Its four cameras are too few to leave any out: the same half circle with 24.
person() {
  if [ ! -d "$out/captures/person-4" ]; then quietly "$bin/lumi-simulate" --example person -o "$out/captures/person-4" --width 64; fi
  sed 's/"views": *4\b/"views": 24/' "$out/captures/person-4/truth/scene.json" >"$out/captures/person-24.json"
  say "person: 24 photos"
  quietly "$bin/lumi-simulate" --replace "$out/captures/person-24.json" -o "$out/captures/person" --width "$([ -n "$quick" ] && echo 240 || echo 480)"
}
# hull SCENE: of its true silhouettes.
hull() { quietly "$bin/lumi-proxy" hull "$out/captures/$1" --silhouettes "$out/captures/$1/truth/silhouettes"; }

proxy=''
for scene in "${only[@]}"; do
  if [ -n "$kept" ] && [ -f "$out/$scene/methods.json" ]; then continue; fi
  case $scene in
    desk)
      capture desk 262 640
      # Photos are held out of a mesh that they did not help to make.
      quietly "$bin/lumi-proxy" delaunay "$out/captures/desk"
      quietly "$bin/lumi-proxy" delaunay "$out/captures/desk" --leave-out 8
      proxy=delaunay ;;
    plaza) capture plaza 480 640; quietly "$bin/lumi-proxy" import "$geometry/plaza.obj" "$out/captures/plaza" --name planes; proxy=planes ;;
    hallway) capture hallway 219 320; quietly "$bin/lumi-proxy" import "$geometry/hallway.obj" "$out/captures/hallway" --name tube; proxy=tube ;;
    car) capture car 36 640; hull car; proxy=hull ;;
    person) person; hull person; proxy=hull ;;
    *)
      [ -d "$data/$scene" ] || { say "skipped: $scene (give --data)"; continue; }
      if [ ! -d "$out/captures/$scene/proxies" ]; then
        if [ "$scene" = knights ]; then
          # A rectified camera grid: places from the files' names, a focal length that nothing tells.
          quietly "$bin/lumi-reconstruct" "$data/knights/images" -o "$out/captures/knights" --rig grid
          quietly "$bin/lumi-proxy" auto "$out/captures/knights"
        else
          quietly "$bin/lumi-pipeline" "$data/$scene/images" -o "$out/captures/$scene"
        fi
      fi
      proxy='' ;;
  esac
  say "$scene: measuring"
  quietly "$bin/lumi-render" methods "$out/captures/$scene" ${proxy:+--proxy "$proxy"} --properties -o "$out/$scene" ${quick:+--views 3 --repeats 1}
done
results=()
for scene in desk plaza hallway car person fox knights; do
  [ ! -f "$out/$scene/methods.json" ] || results+=("$out/$scene/methods.json")
done
"$bin/lumi-render" table-3-1 "${results[@]}" -o "$out/table-3-1.md"
say "$out/table-3-1.md"
