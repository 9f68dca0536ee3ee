#!/usr/bin/env bash
# Web pages in Chromium: against lumi-render, frame time, first picture, memory; 1,000 photos streamed
# Programs: lumi-export lumi-simulate web_bench bench_figures lumi-pipeline lumi-reconstruct lumi-proxy lumi-render
. "${BASH_SOURCE[0]%/*}/common.sh"

# Whole captures beside simulated ones.
web_pages() {
  local scene scenes=()
  for scene in fox sceaux fountain; do
    if captured "$scene"; then scenes+=(--capture "$work/$scene"); fi
  done
  printf '\n## Web pages in Chromium\n\n'
  "$bin/web_bench" --work "$work" "${scenes[@]}" --streamed 1000 || {
    [ $? -eq 4 ] || return 1
    say "no browser: web pages are not measured"
  }
}
web_pages
