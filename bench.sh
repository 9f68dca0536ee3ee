#!/usr/bin/env bash
# Measures and prints, as Markdown, the figures that README and docs quote. Its parts, each a script in scripts/bench:
#
# PARTS
#
#   ./bench.sh                    all of them but large, gpu, methods and table-3-1, on what lumi-simulate photographs
#   ./bench.sh --data DIR         also on real captures below DIR (fountain, sceaux, fox, knights, dinosaur, boards-stereo,
#                                 boards-wide, shaky-sideways, shaky-rotation), where they are there
#   ./bench.sh --only PART        that part; may be given again.  --only methods DIR: a scene or COLMAP
#                                 workspace, or every one in DIR; --width W renders at that width
#   ./bench.sh --list             the parts
#   ./bench.sh --update-docs      also writes what was printed into docs/figures.json, and from there into README and docs
#   ./bench.sh --continue         leaves out parts that these same programs have printed: an interrupted bench goes on
#   captures takes --views N (photos rendered at their own cameras) and --capture NAME; walk takes --photos N,N
#
# Scenes are kept in build/bench: a second run measures again without finding the cameras again (delete it to begin anew).
# What a part printed is in build/bench/printed. Milliseconds want a machine without other work. Exit code 1: a part
# failed, and the others were run.
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")"
. scripts/common.sh

# Programs that are interrupted say so themselves, and end: this script would go on with the next part.
trap 'exit 130' INT

parts=(captures dense dense-cost effects correlation speed proxies hulls cameras walk calibration factorization periods moments periodic unseen stabilize video web flush price minutes scale large gpu methods table-3-1)
# What a part says of itself: its line Title, or the programs that it needs.
title() { sed -n '2s/^# //p' "scripts/bench/$1.sh"; }
programs() { sed -n 's/^# Programs: //p' "scripts/bench/$1.sh"; }
absolute() { case $1 in /*) printf '%s' "$1" ;; *) printf '%s' "$start_folder/$1" ;; esac; }

only=() data='' methods='' width=() update='' go_on='' of_captures=() of_walk=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help)
      sed -n '2,/^set -/s/^# \{0,1\}//p' "${BASH_SOURCE[0]##*/}" | while IFS= read -r line; do
        if [ "$line" != PARTS ]; then printf '%s\n' "$line"; else for part in "${parts[@]}"; do printf '  %-14s %s\n' "$part" "$(title "$part")"; done; fi
      done
      exit 0 ;;
    --list) printf '%s\n' "${parts[@]}"; exit 0 ;;
    --update-docs) update=1; shift ;;
    --continue) go_on=1; shift ;;
    --data | --only | --photos | --views | --capture | --width)
      [ $# -ge 2 ] || die "$1 needs a value" 2
      case $1 in
        --data) data=$(absolute "$2"); [ -d "$data" ] || die "$data is no folder" 2 ;;
        --photos) of_walk=("$2") ;;
        --width) width=("$2") ;;
        --views) of_captures+=(--views "$2") ;;
        --capture) of_captures+=(--only "$2") ;;
        --only)
          [[ " ${parts[*]} " == *" $2 "* ]] || die "there is no part $2 (see --list)" 2
          only+=("$2")
          if [ "$2" = methods ]; then
            [ $# -ge 3 ] || die "--only methods needs a folder of scenes" 2
            methods=$(absolute "$3"); [ -d "$methods" ] || die "$methods is no folder" 2
            shift
          fi ;;
      esac
      shift 2 ;;
    *) die "$1 is no option (see --help)" 2 ;;
  esac
done
if [ -n "$update" ] && [ ${#of_walk[@]} -gt 0 -o ${#of_captures[@]} -gt 0 ]; then
  die "--update-docs records whole parts: it goes without --photos, --views and --capture" 2
fi
if [ ${#only[@]} -eq 0 ]; then
  for part in "${parts[@]}"; do [[ " large gpu methods table-3-1 " == *" $part "* ]] || only+=("$part"); done
fi

has() { [[ " ${only[*]} " == *" $1 "* ]]; }
[ ${#of_captures[@]} -eq 0 ] || has captures || die "--views and --capture are for the part captures" 2
[ ${#width[@]} -eq 0 ] || has methods || die "--width is for the part methods" 2
[ ${#of_walk[@]} -eq 0 ] || has walk || die "--photos is for the part walk" 2
# What was measured on captures is not replaced by what was measured without them: pages quote their rows.
if [ -n "$update" ] && [ -z "$data" ]; then
  for part in "${only[@]}"; do
    if grep -q "\"command\": \"./bench.sh --only $part --data " docs/figures.json 2>/dev/null; then
      die "docs/figures.json has $part as measured with --data: give it" 2
    fi
  done
fi

install_packages
mapfile -t targets < <(for part in "${only[@]}"; do programs "$part" | tr ' ' '\n'; done | sort -u)
build release docs_figures "${targets[@]}"
export LUMI_BENCH_WORK=build/bench LUMI_BENCH_DATA=$data LUMI_BENCH_UPDATE=$update
printed=$LUMI_BENCH_WORK/printed
mkdir -p "$printed"
machine="$(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | head -n 1), $(nproc) cores; $(cat build/release/versions.txt); $(colmap help 2>/dev/null | grep -o 'COLMAP [0-9.]*' | head -n 1 || true)"
version=$(build/release/bin/docs_figures --version | cut -d' ' -f2-)
printf 'Built with %s.\n' "$machine"

# What printed a part, beside what it printed: programs of this version, on this machine, on these captures.
printed_by() { printf '%s\n%s\n%s\n%s\n' "$version" "$machine" "$data" "${arguments[*]} $update"; }
# The seconds that this part took; fails where it is not there, other programs printed it, or some with changes did.
printed_before() {
  [[ $version != *-changed* && $version != *'no git'* ]] && [ -f "$printed/$part.md" ] && [ -f "$printed/$part.by" ] || return 1
  [ "$(head -n 4 "$printed/$part.by")" = "$(printed_by)" ] && sed -n '5{/^[0-9]\+$/!q1;p}' "$printed/$part.by"
}
record() {
  local command="./bench.sh --only $part"
  [ "$part" != methods ] || command+=' DIR'
  [ -z "$data" ] || command+=' --data DIR'
  build/release/bin/docs_figures record "$part" --command "$command" --machine "$machine" --of "$version" --seconds "$1" <"$printed/$part.md"
}

failed=() all_seconds=0 left_out=0
for part in "${only[@]}"; do
  arguments=()
  case $part in
    captures) arguments=("${of_captures[@]}") ;;
    walk) arguments=("${of_walk[@]}") ;;
    methods) arguments=("$methods" "${width[@]}") ;;
  esac
  if [ -n "$go_on" ] && seconds=$(printed_before) && [ -n "$seconds" ]; then
    cat "$printed/$part.md"
    say "$part: nothing to do: it was printed in $seconds s"
    [ -z "$update" ] || record "$seconds"
    all_seconds=$((all_seconds + seconds)) left_out=$((left_out + 1))
    continue
  fi
  say "$part: $(title "$part")"
  rm -f "$printed/$part.by"
  begin=$(date +%s)
  if "scripts/bench/$part.sh" "${arguments[@]}" | tee "$printed/$part.part"; then
    seconds=$(($(date +%s) - begin))
    mv "$printed/$part.part" "$printed/$part.md"
    { printed_by; printf '%s\n' "$seconds"; } >"$printed/$part.by"
    all_seconds=$((all_seconds + seconds))
    say "$part: $seconds s"
    [ -z "$update" ] || record "$seconds"
  else
    failed+=("$part")
    say "$part failed"
  fi
done
if [ -n "$update" ] && [ ${#failed[@]} -lt ${#only[@]} ]; then
  say "pages that changed:"
  build/release/bin/docs_figures update >&2
fi
say "$((${#only[@]} - ${#failed[@]})) parts took $all_seconds s together, $left_out of them in runs before"
[ ${#failed[@]} -eq 0 ] || die "failed: ${failed[*]}" 1
