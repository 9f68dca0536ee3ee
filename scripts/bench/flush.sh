#!/usr/bin/env bash
# What waiting for the disk costs the pipeline
# Programs: lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export fault_injection
. "${BASH_SOURCE[0]%/*}/common.sh"

# What waiting for the disk takes of the whole pipeline on 24 photos: each flush is timed, by a library that is preloaded.
flush_cost() {
  local photos=$work/flush-desk scene=$work/flush-scene log=$work/flush.log begin
  simulated flush-desk desk --views 24 --width 640
  rm -rf "$scene" "$log"
  begin=$(date +%s.%N)
  LD_PRELOAD=$PWD/$bin/../tests/libfault_injection.so LUMI_FLUSH_LOG=$log \
    "$bin/lumi-pipeline" "$photos/images" -o "$scene" --poses "$photos/truth/sparse" --quiet >/dev/null
  printf '\n## Waiting for the disk: the pipeline on 24 photos\n\n| seconds | of these waiting | flushes | share %% |\n|---|---|---|---|\n'
  awk -v begin="$begin" -v end="$(date +%s.%N)" '$1 == "flushed" { waited += $2 / 1e6; n += 1 }
    END { printf "| %.1f | %.2f | %d | %.2f |\n", end - begin, waited, n, 100 * waited / (end - begin) }' "$log"
  rm -rf "$scene" "$log"
}
flush_cost
