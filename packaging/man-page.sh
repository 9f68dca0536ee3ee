#!/usr/bin/env bash
# man-page.sh HELP2MAN PROGRAM PAGE.1: the manual page of a program, and PAGE.1.gz, from its --help and its commands' own.
set -euo pipefail
help2man=$1 program=$2 page=$3
name=${program##*/}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
description=$("$program" --help | head -n 1)
{
  printf '[exit status]\n'
  printf '0 done; 1 the data do not allow it; 2 wrong usage; 3 an input that cannot be read; 4 the machine does not allow it; 5 a bug of ours; 130 interrupted.\n'
} >"$work/more"
"$help2man" --no-info --section 1 --help-option=--help-all --name "${description,}" --include "$work/more" --no-discard-stderr --output "$page" "$program"
# The words that an option takes may stand in several lines, which nothing can stretch to the margin.
sed -i 's/|/|\\:/g; s/^\.SH .*/&\n.ad l/; s/^\.TP$/&\n.ad l/' "$page"
gzip -9nkf "$page"
