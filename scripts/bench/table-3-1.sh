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
