#!/usr/bin/env bash
# Published methods and this renderer on the captures of the thesis's table 3.1: quality, time, eleven properties (hours)
# Programs: lumi-simulate lumi-proxy lumi-render lumi-reconstruct lumi-pipeline lumi-export
. "${BASH_SOURCE[0]%/*}/common.sh"

out=$work/table-3-1
scripts/thesis-tables.sh "$out" --bin "$bin" --continue ${data:+--data "$data"}
heading 'Published methods, held out'
"$bin/lumi-render" methods-report "$out"/*/methods.json
heading 'Table 3.1 as figures'
cat "$out/table-3-1.md"
# Beside the page: a capture's results as JSON, a row a method and view as CSV, and quality against time as a plot.
if [ -n "${LUMI_BENCH_UPDATE:-}" ]; then
  mkdir -p docs/benchmark
  for results in "$out"/*/methods.json; do
    folder=${results%/methods.json}
    cp "$results" "docs/benchmark/${folder##*/}.json"
    cp "$folder/methods-views.csv" "docs/benchmark/${folder##*/}-views.csv"
    cp "$folder/methods.svg" "docs/benchmark/${folder##*/}.svg"
  done
fi
