#!/bin/sh
# Where the time goes, to look at in a browser: call tree, flame graph, timeline and source lines, by `samply`.
#
#     profiling/samply.sh [--save FILE.json.gz] [SCENE and options of `comber render`...]
#
#     profiling/samply.sh scenes/cornell_spheres.dae -s 64
#     profiling/samply.sh --save spheres.json.gz scenes/cornell_spheres.dae -s 64
#
# All threads, unless `--threads 1` is among the options. Opens the Firefox Profiler with the profile, which stays on this machine; with
# --save it is only written, and the symbols beside it, for `samply load FILE.json.gz` there or elsewhere.
set -eu
command -v samply > /dev/null || { echo "samply.sh: samply is not installed: cargo install samply" >&2; exit 1; }
project=$(cd "$(dirname "$0")/.." && pwd)
save=
if [ "${1:-}" = --save ]; then
    [ $# -ge 2 ] || { echo "samply.sh: --save needs a file" >&2; exit 2; }
    save=$2
    shift 2
fi
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
comber=$("$project/profiling/build.sh")
# Where the processor has no counters to sample by (virtual machines, as a rule) samply takes a clock; where it is not permitted to
# sample at all, it tells which setting to change.
if [ -n "$save" ]; then
    samply record --rate 1999 --save-only --unstable-presymbolicate --output "$save" -- \
        "$comber" render "$@" -o "$dir/picture.png"
else
    samply record --rate 1999 --output "$dir/profile.json.gz" -- "$comber" render "$@" -o "$dir/picture.png"
fi
