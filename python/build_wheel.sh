#!/usr/bin/env bash
# Builds the wheel for a target of rustc, by default that of this machine, into OUT/wheels. Equal
# sources make equal bytes, in any folder.
# Usage: build_wheel.sh PYTHON OUT [TARGET]
set -euo pipefail
cd "$(dirname "$0")/.."

python=$1 out=$2
target=${3:-$(rustc -vV | sed -n 's/^host: //p')}
mkdir -p "$out"
out=$(cd "$out" && pwd)
[ -x "$out/tools/bin/maturin" ] || {
    "$python" -m venv "$out/tools"
    "$out/tools/bin/python" -m pip install --quiet "maturin[zig]==1.16.0"
}
case $target in
# The linker of zig knows old versions of the C library, so that the wheel runs with them.
*-linux-gnu) platform=(--zig --compatibility manylinux2014) ;;
*) platform=() ;;
esac
# Messages of panics name source files, which lie elsewhere on other machines.
export RUSTFLAGS="--remap-path-prefix=$PWD=/meshmark --remap-path-prefix=${CARGO_HOME:-$HOME/.cargo}=/cargo"
export SOURCE_DATE_EPOCH=315532800 # 1980, as early as an archive can say
CARGO_TARGET_DIR=$out/build PATH=$out/tools/bin:$PATH "$out/tools/bin/maturin" build --quiet --release --locked \
    --target "$target" "${platform[@]}" --manifest-path python/Cargo.toml --out "$out/wheels"
