#!/bin/sh
# The wave-size curve: whole renders with waves of 2^8 to 2^20 rows.
#
#     profiling/wave_curve.sh runs/2026-11-22-xeon-2c [SCENE...]
#
# Writes wave_size.csv, wave_size.txt (a table) and machine.txt into that folder of profiling/, and prints the table.
set -eu
[ $# -ge 1 ] || { sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//p;}' "$0"; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
out=$here/$1
shift
mkdir -p "$out"
"$here/machine.sh" > "$out/machine.txt"
cd "$here/.."
cargo bench --quiet --bench wave_size -- "${@:-}" > "$out/wave_size.csv"
awk -F, '
    NR == 1 { next }
    $1 != scene { scene = $1; printf "%s%s\n%9s %9s %8s %9s %9s\n", (NR > 2 ? "\n" : ""), $1, "rows", "KiB", "Mray/s", "of best", "cpu" }
    { printf "%9d %9d %8.2f %8.1f%% %8.1f%%\n", $2, $3 / 1024, $4, 100 * $5, 100 * $7 }
' "$out/wave_size.csv" | tee "$out/wave_size.txt"
