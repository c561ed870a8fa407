#!/bin/sh
# The facts without which a figure means nothing: processor, caches, compiler, commit, load.
set -eu
cd "$(dirname "$0")/.."
echo "processor  $(sed -n 's/^model name[[:space:]]*: //p' /proc/cpuinfo | head -1), $(nproc) cores"
for cache in /sys/devices/system/cpu/cpu0/cache/index*; do
    [ -e "$cache/size" ] || continue
    echo "cache      L$(cat "$cache/level") $(cat "$cache/type" | tr '[:upper:]' '[:lower:]') $(cat "$cache/size")"
done
echo "memory     $(sed -n 's/^MemTotal:[[:space:]]*//p' /proc/meminfo)"
echo "system     $(uname -s) $(uname -r | sed 's/-.*//')"
echo "compiler   $(rustc --version)"
echo "commit     $(git rev-parse --short HEAD)$(git diff --quiet HEAD -- src Cargo.toml Cargo.lock || echo ', with changes')"
echo "load       $(cut -d' ' -f1-3 /proc/loadavg)"
