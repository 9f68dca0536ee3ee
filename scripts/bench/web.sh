#!/usr/bin/env bash
# Web pages in Chromium: against lumi-render, frame time, first picture, memory; 1,000 photos streamed
# Programs: lumi-export lumi-simulate web_bench bench_figures lumi-pipeline lumi-reconstruct lumi-proxy lumi-render
. "${BASH_SOURCE[0]%/*}/common.sh"

install_packages chromium
# Whole captures beside simulated ones.
scenes=()
for scene in fox sceaux fountain; do
  if captured "$scene"; then scenes+=(--capture "$work/$scene"); fi
done
heading 'Web pages in Chromium'
"$bin/web_bench" --work "$work" ${scenes[@]+"${scenes[@]}"} --streamed 1000
