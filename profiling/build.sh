#!/bin/sh
# Builds the release binary for profiling and prints its path. Its symbols keep their type parameters, so that the kernels,
# which all run through one generic function, can be told apart. It has a target folder of its own.
set -eu
project=$(cd "$(dirname "$0")/.." && pwd)
target=${CARGO_TARGET_DIR:-$project/target}/profiling
RUSTFLAGS="${RUSTFLAGS:-} -Csymbol-mangling-version=v0" cargo build --quiet --release \
    --manifest-path "$project/Cargo.toml" --target-dir "$target"
echo "$target/release/comber"
