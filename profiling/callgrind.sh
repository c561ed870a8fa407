#!/bin/sh
# Instructions and mispredicted branches a ray, by function, without noise: the same on a busy machine as on a quiet one.
#
#     profiling/callgrind.sh [--keep DIR] [SCENE and options of `comber render`...]
#     profiling/callgrind.sh --rays SETS [SCENE and options of `comber bench`...]
#
#     profiling/callgrind.sh scenes/cornell_spheres.dae
#     profiling/callgrind.sh scenes/models/dragon_vrip.ply --simd baseline
#     profiling/callgrind.sh --rays D,S --stage none scenes/models/lucy100k.obj
#
# Renders 64x48 pixels on one thread under valgrind, with 8 samples a pixel and again with 24. The difference is 16 samples
# a pixel and nothing else: reading, building and writing cancel. What valgrind cannot execute (AVX-512) comber never uses.
# COMBER=FILE takes that binary instead of building one. Branches are predicted as valgrind models it: a table of 2-bit counters, which is worse than today's processors do.
# With --rays it counts what each kernel and each mode of Embree takes for the same rays: see callgrind_rays.sh.
# With --keep the profiles stay, for `callgrind_annotate --auto=yes DIR/many`.
set -eu
command -v valgrind > /dev/null || { echo "callgrind.sh: valgrind is not installed" >&2; exit 1; }
project=$(cd "$(dirname "$0")/.." && pwd)
if [ "${1:-}" = --rays ]; then
    shift
    exec "$project/profiling/callgrind_rays.sh" "$@"
fi
if [ "${1:-}" = --keep ]; then
    mkdir -p "$2"
    dir=$(cd "$2" && pwd)
    shift 2
else
    dir=$(mktemp -d)
    trap 'rm -rf "$dir"' EXIT
fi
comber=${COMBER:-$("$project/profiling/build.sh")}

# run NAME SAMPLES OPTIONS...: a profile, and the number of rays.
run() {
    name=$1 samples=$2
    shift 2
    valgrind --tool=callgrind --branch-sim=yes --callgrind-out-file="$dir/$name" --log-file="$dir/$name.log" \
        "$comber" render "$@" --size 64 48 -s "$samples" --threads 1 --quiet --json -o "$dir/$name.png" > "$dir/$name.json"
    sed -n 's/^ *"\(camera\|bounce\|shadow\)": \([0-9]*\),\{0,1\}$/\2/p' "$dir/$name.json" | paste -sd+ | bc > "$dir/$name.rays"
    # Instructions, mispredicted branches (conditional and indirect), and names of functions without the file before them, the
    # module path within them and the object behind them.
    callgrind_annotate --threshold=100 --show-percs=no --show=Ir,Bcm,Bim --auto=no "$dir/$name" |
        sed -n 's/^ *\([0-9,]\{1,\}\)  *\([0-9,.]\{1,\}\)  *\([0-9,.]\{1,\}\)  *[^ :]*:\(.*\)$/\1\t\2\t\3\t\4/p' |
        sed 's/ \[[^]]*\]$//; s/comber::simd::run_avx2::<\(.*\)>/\1/; s/comber::simd::Kernel/Kernel/' > "$dir/$name.functions"
}
run few 8 "$@"
run many 24 "$@"

rays=$(($(cat "$dir/many.rays") - $(cat "$dir/few.rays")))
awk -F'\t' -v rays="$rays" '
    function number(text) { gsub(",", "", text); return text == "." ? 0 : text + 0 }
    { sign = FILENAME ~ /few/ ? -1 : 1; cost[$4] += sign * number($1); missed[$4] += sign * (number($2) + number($3)) }
    END {
        for (f in cost) { total += cost[f]; misses += missed[f] }
        printf "%12s %8s %10s\n", "instructions", "share", "mispredicted"
        printf "%12.1f %8s %10.2f  a ray in all, %d rays\n", total / rays, "", misses / rays, rays
        fflush()
        for (f in cost) if (cost[f] > 0.004 * total)
            printf "%12.1f %6.1f %% %10.2f  %s\n", cost[f] / rays, 100 * cost[f] / total, missed[f] / rays, f | "sort -rn"
    }
' "$dir/few.functions" "$dir/many.functions"
