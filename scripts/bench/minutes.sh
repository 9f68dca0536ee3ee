#!/usr/bin/env bash
# lumi-pipeline --minutes: what was asked for, what it took, and the error of left-out photos, of desk, and of fox below --data
# Programs: lumi-simulate lumi-pipeline lumi-reconstruct lumi-proxy lumi-render lumi-export
. "${BASH_SOURCE[0]%/*}/common.sh"

simulated desk-capture desk --views 24 --width 640
heading 'lumi-pipeline --minutes'
printf '| capture | minutes asked | took | quality | cameras expected | left out | met | PSNR dB | seen dB |\n|---|---|---|---|---|---|---|---|---|\n'
# kept NAME INPUT MINUTES: a row.
kept() {
  local json minutes error
  rm -rf "$work/minutes-$1"
  json=$("$bin/lumi-pipeline" "$2" -o "$work/minutes-$1" --minutes "$3" --json --quiet 2>/dev/null | tr -d '\n')
  minutes=$(grep -o '"minutes": *{[^}]*}' <<<"$json")
  error=$(grep -o '"psnr_mean_db": *[0-9.]*, *"psnr_seen_mean_db": *[0-9.]*' <<<"$json" | tail -n 1)
  printf '| %s | %s | %s | %s | %s | %s | %s | %s | %s |\n' "$1" "$3" "$(json_figure "$minutes" took 1)" "$(json_text "$minutes" quality)" \
    "$(json_figure "$minutes" expected_camera_minutes 1)" "$(grep -o '"left_out": *\[[^]]*\]' <<<"$minutes" | grep -o '"[a-z-]*"' | tr -d '"' | tr '\n' ' ')" \
    "$(grep -o '"met": *[a-z]*' <<<"$minutes" | grep -o '[a-z]*$')" "$(json_figure "$error" psnr_mean_db)" "$(json_figure "$error" psnr_seen_mean_db)"
}
for minutes in 0.3 1 2 4; do kept desk "$work/desk-capture/images" "$minutes"; done
[ ! -d "${data:-/nowhere}/fox" ] || for minutes in 1 3 6 10; do kept fox "$data/fox/images" "$minutes"; done
