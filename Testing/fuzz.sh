#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# fuzz.sh FUZZER SEEDS.py SECONDS: runs a libFuzzer program from the seeds that SEEDS.py writes (none when there is no such
# file) and from what earlier runs found. It ends with a status that is not 0 when the fuzzer broke something; the input that
# did it lies in the folder that is named then.
set -euo pipefail
fuzzer=$1 seeds=$2 seconds=$3
work=$(dirname "$fuzzer")/corpus/$(basename "$fuzzer")
mkdir -p "$work/seeds" "$work/found" "$work/broken"
if [ -f "$seeds" ]; then /usr/bin/python3 "$seeds" "$work/seeds"; fi
status=0
"$fuzzer" -max_total_time="$seconds" -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=1024 -seed=1 -print_final_stats=1 \
  -artifact_prefix="$work/broken/" "$work/found" "$work/seeds" >"$work/log" 2>&1 || status=$?
grep -E "^stat::(number_of_executed_units|average_exec_per_sec|peak_rss_mb)|DONE" "$work/log" | tail -4 || true
if [ "$status" != 0 ]; then
  grep -v "^#" "$work/log" | tail -60
  echo "the input that did it: $work/broken"
fi
exit "$status"
