#!/usr/bin/env bash
# The period finder on painted videos that it was not tuned on: how often it is right, and whether it knows its own error
# Programs: period_bench
. "${BASH_SOURCE[0]%/*}/common.sh"

heading 'The period finder on videos that it was not tuned on'
"$bin/period_bench" 24
