#!/bin/sh
# Where the time goes: the functions that samples of `perf` find most often.
#
#     profiling/perf.sh [SCENE and options of `comber render`...]
#
#     profiling/perf.sh scenes/cornell_spheres.dae -s 64
#
# One thread. Kernels are one large function each; `perf annotate` has their lines.
set -eu
command -v perf > /dev/null || { echo "perf.sh: perf is not installed; callgrind.sh needs valgrind only" >&2; exit 1; }
project=$(cd "$(dirname "$0")/.." && pwd)
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
comber=$("$project/profiling/build.sh")
# Cycles where the processor lets itself be watched, else a clock: virtual machines have no counters, as a rule.
event=cycles:u
perf stat -e $event true > "$dir/stat" 2>&1 && ! grep -q 'not supported' "$dir/stat" || event=cpu-clock:u
if ! perf record -q -e $event -F 1999 -o "$dir/data" "$comber" render "$@" --threads 1 -o "$dir/picture.png" 2> "$dir/log"; then
    cat "$dir/log" >&2
    echo "perf.sh: perf may not record here; /proc/sys/kernel/perf_event_paranoid is $(cat /proc/sys/kernel/perf_event_paranoid) and must be 2 or less" >&2
    exit 1
fi
echo "by function ($event)"
perf report -i "$dir/data" --no-children --stdio --percent-limit 0.5 --sort symbol 2> /dev/null | grep -v '^#' | grep .
