#!/usr/bin/env bash
# Compiles fuzz targets, all without an argument, into target/fuzz/build: build.sh [TARGET...].
set -euo pipefail
cd "$(dirname "$0")/.."

RUSTC_WRAPPER=$PWD/fuzz/rustc.sh "${CARGO:-cargo}" build --release --locked --manifest-path fuzz/Cargo.toml \
    --target "$(rustc -vV | sed -n 's/^host: //p')" --target-dir target/fuzz/build "${@/#/--bin=}"
