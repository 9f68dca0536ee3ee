#!/usr/bin/env bash
# Cameras from photos of checkerboards: boards-stereo and boards-wide below --data, and simulated boards
# Programs: calibration_bench test_calibrate test_calibrate_simulated_boards
. "${BASH_SOURCE[0]%/*}/common.sh"

heading Calibration
[ -z "$data" ] || "$bin/calibration_bench" "$data"
heading 'Standard deviations against the spread over 100 simulated sets, and ray-traced boards'
printf '```\n'
"$bin/test_calibrate" --gtest_filter=Refinement.StandardDeviations* --gtest_brief=1 | grep ratio
"$bin/test_calibrate_simulated_boards" --gtest_brief=1 | grep -E 'sigma|views'
printf '```\n'
