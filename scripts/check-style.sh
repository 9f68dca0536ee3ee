#!/usr/bin/env bash
# Lists what is longer than it should be: functions over 100 lines or six parameters, lines over 120 columns, files over 600 lines.
#
#   scripts/check-style.sh [FILE|FOLDER ...]     all C++ that git knows, where none is given
#
# Functions need universal-ctags (Debian: universal-ctags); without it the rest is listed. Exits 1 where there is something to list.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
case ${1:-} in -h | --help) sed -n '2,6s/^# \{0,1\}//p' "scripts/${BASH_SOURCE[0]##*/}"; exit 0 ;; esac

mapfile -t files < <(git ls-files -- "$@" | grep -E '\.(cc|h)$' || true)
[ ${#files[@]} -gt 0 ] || { echo "no C++ file in: $*" >&2; exit 2; }

list() {
  for file in "${files[@]}"; do
    lines=$(wc -l <"$file")
    [ "$lines" -le 600 ] || echo "$file: $lines lines"
  done
  LC_ALL=C.UTF-8 grep -nE '^.{121}' "${files[@]}" | sed -E 's/^([^:]*:[0-9]+):.*/\1: over 120 columns/' || true
  if ! ctags --version 2>/dev/null | grep -q '^Universal'; then
    echo "universal-ctags is not installed: functions were not looked at" >&2
    return
  fi
  # A parameter is what a comma outside of brackets parts from the next.
  ctags -o - --languages=C++ --langmap=C++:.cc.h --kinds-C++=f --fields=+neS --sort=no "${files[@]}" | awk -F'\t' '
    {
      first = last = 0; signature = ""
      for (i = 4; i <= NF; ++i) {
        if ($i ~ /^line:/) first = substr($i, 6)
        if ($i ~ /^end:/) last = substr($i, 5)
        if ($i ~ /^signature:/) signature = substr($i, 11)
      }
      if (last - first + 1 > 100) printf "%s:%d: %s has %d lines\n", $2, first, $1, last - first + 1
      depth = 0; parameters = signature ~ /^\( *(void)? *\)/ ? 0 : 1
      for (i = 1; i <= length(signature); ++i) {
        c = substr(signature, i, 1)
        if (index("(<{[", c)) ++depth
        if (index(")>}]", c)) --depth
        if (c == "," && depth == 1) ++parameters
      }
      if (parameters > 6) printf "%s:%d: %s has %d parameters\n", $2, first, $1, parameters
    }'
}

found=$(list)
[ -z "$found" ] || { printf '%s\n' "$found"; exit 1; }
