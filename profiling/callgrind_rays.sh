#!/bin/sh
# Instructions a ray of comber's kernels and of Embree's modes, on the same rays.
#
#     profiling/callgrind_rays.sh SETS [SCENE and options of `comber bench`...]
#
#     profiling/callgrind_rays.sh D,S --stage none scenes/models/lucy100k.obj
#     MODES="single;packets of 8, incoherent" profiling/callgrind_rays.sh D,D2,S --stage none dragon.ply --peer-robust off
#
# Makes the rays of a frame of 256x256 pixels without valgrind, and traces them once under it for each kernel and mode. Only
# trace calls are counted: reading, building and laying out records are not. Without Embree, only comber's kernels are.
# COMBER=FILE takes that binary instead of building one. valgrind 3.19 has no AVX-512 and tells so: what Embree executes here are its kernels for AVX2 (--peer-isa for others).
set -eu
command -v valgrind > /dev/null || { echo "callgrind_rays.sh: valgrind is not installed" >&2; exit 1; }
sets=${1:?"usage: callgrind_rays.sh SETS SCENE..."}
shift
project=$(cd "$(dirname "$0")/.." && pwd)
comber=${COMBER:-$("$project/profiling/build.sh")}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

peer=
"$comber" bench proc:cubes,tris=12 --stage none --size 8 8 --sets P --only peer --peer embree --repeats 1 --turn 0 --json \
    > "$dir/peer" 2> /dev/null && peer="--peer embree"
# Options of the peer have no meaning without it.
"$comber" bench "$@" $peer --size 256 256 --sets "$sets" --only kernels --kernel single --repeats 1 --turn 0 --quiet \
    --dump-rays "$dir/rays"
versions=$(sed -n 's/^ *"version": "\(.*\)",\{0,1\}$/\1/p' "$dir/peer" | sort -u)
kernels=$("$comber" bench --kernel '?' 2>&1 | sed -n 's/.*there are //p' | tr -d ,)
modes=${MODES:-"single;packets of 4, incoherent;packets of 8, incoherent;packets of 8, coherent;stream of 8192, incoherent"}

# count SET NAME FUNCTION OPTIONS...: a line of the table, or nothing if there is no such mode.
count() {
    set_name=$1 name=$2 function=$3
    shift 3
    valgrind --tool=callgrind --callgrind-out-file="$dir/out" --log-file="$dir/log" --toggle-collect="$function" \
        "$comber" bench "$@" --rays "$dir/rays" --once "$set_name" --threads 1 --json > "$dir/json" 2> "$dir/errors" || {
        grep -q 'no mode has' "$dir/errors" && return
        cat "$dir/errors" >&2
        exit 1
    }
    instructions=$(sed -n 's/.*Collected : \([0-9]*\).*/\1/p' "$dir/log")
    rays=$(sed -n 's/^ *"rays": \([0-9]*\),\{0,1\}$/\1/p' "$dir/json")
    awk -v s="$set_name" -v n="$name" -v i="$instructions" -v r="$rays" \
        'BEGIN { printf "%-4s %10.1f  %8d  %s\n", s, i / r, r, n }'
}

printf '%-4s %10s  %8s  %s\n' set "per ray" rays who
for set in $(echo "$sets" | tr , ' '); do
    for kernel in $kernels; do
        count "$set" "comber $kernel" '*kernels*Tracer*trace*' "$@" $peer --kernel "$kernel"
    done
    for version in $versions; do
        rest=$modes
        while [ -n "$rest" ]; do
            mode=${rest%%;*}
            case $rest in *";"*) rest=${rest#*;} ;; *) rest= ;; esac
            count "$set" "Embree $version $mode" '*embree*trace*Tracer*timed*' "$@" $peer --peer-mode "$version medium $mode"
        done
    done
done
