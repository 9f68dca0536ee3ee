#!/usr/bin/env bash
# thesis_tables_test.sh BIN: scripts/thesis-tables.sh makes Table 3.1 of the quickest capture; --continue measures nothing again.
set -euo pipefail
script=$(cd "$(dirname "${BASH_SOURCE[0]}")/../../scripts" && pwd)/thesis-tables.sh
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT
fail() { printf 'thesis_tables_test: %s\n' "$*" >&2; exit 1; }

"$script" "$out" --quick --only car --bin "$1" >"$out/log" 2>&1 || fail "the script failed: $(tail -n 3 "$out/log")"
# An algorithm of the thesis is measured, or its row says why it is not, or on which capture it was refused.
rows=$(sed -n '/^| Chen and Williams 1993/,/^| Wood et al. 2000/p' "$out/table-3-1.md")
[ "$(wc -l <<<"$rows")" = 14 ] || fail "there are not fourteen algorithms: $rows"
measured=$(grep -cE '\| (\*\*yes\*\*|no) [0-9]' <<<"$rows") || true
explained=$(grep -cE 'not measured: .+|\| car \|$' <<<"$rows") || true
[ $((measured + explained)) = 14 ] || fail "$measured are measured and $explained are explained: $rows"
[ "$measured" -ge 9 ] || fail "only $measured are measured: $rows"
grep -qE "^\| unstructured lumigraph \| (\*\*yes\*\*|no) [0-9]" "$out/table-3-1.md" || fail "our own row is missing"

was=$(stat -c %y "$out/car/methods.json")
"$script" "$out" --quick --only car --bin "$1" --continue >"$out/log" 2>&1 || fail "--continue failed"
[ "$was" = "$(stat -c %y "$out/car/methods.json")" ] || fail "--continue measured again"
