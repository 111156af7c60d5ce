#!/usr/bin/env bash
# The compiler of the fuzz targets: counts edges and comparisons of our own code for libFuzzer, which
# needs no nightly compiler, with checks that users do not have and that find faults which their
# results hide.
set -euo pipefail

case " $* " in
*" --crate-name build_script_"*) ;;
*" --crate-name "*)
    set -- "$@" -Cdebug-assertions=on -Coverflow-checks=on -Cdebuginfo=line-tables-only \
        -Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 \
        -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table \
        -Cllvm-args=-sanitizer-coverage-trace-compares
    ;;
esac
exec "$@"
