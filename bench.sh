#!/usr/bin/env bash
# Prints every figure that README and docs quote, as Markdown; the same as JSON is in build/bench/figures.json.
#
#   ./bench.sh               on a desk that lumi-simulate photographs
#   ./bench.sh --data DIR    also on fountain, sceaux and fox below DIR
#   ./bench.sh --only NAME   on one of them;  --views N photos rendered at their own cameras (4)
# Scenes are kept in build/bench: a second run measures again without finding the cameras again.
set -euo pipefail
start_folder=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")"
. scripts/common.sh

arguments=()
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) sed -n '2,8s/^# \{0,1\}//p' "${BASH_SOURCE[0]##*/}"; exit 0 ;;
    --data)
      [ $# -ge 2 ] || die "--data needs a folder" 2
      case $2 in /*) data=$2 ;; *) data=$start_folder/$2 ;; esac
      [ -d "$data" ] || die "$data is no folder" 2
      arguments+=(--data "$data"); shift 2 ;;
    *) arguments+=("$1"); shift ;;
  esac
done

install_packages
build release lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-simulate bench_figures
build/release/bin/bench_figures --work build/bench "${arguments[@]}"
