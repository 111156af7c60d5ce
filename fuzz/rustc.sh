#!/usr/bin/env bash
# The compiler of the fuzz targets: counts edges and comparisons for libFuzzer in our own code and in
# the parsers that it uses. The flags need no nightly compiler.
set -euo pipefail

case " $* " in
*" --crate-name build_script_"*) ;;
*" --crate-name meshmark_"* | *" --crate-name csv"* | *" --crate-name serde_json "*)
    set -- "$@" -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
        -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
        -Cllvm-args=-sanitizer-coverage-trace-compares
    ;;
esac
exec "$@"
