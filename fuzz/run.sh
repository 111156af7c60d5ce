#!/usr/bin/env bash
# Builds the fuzz targets and runs them side by side: run.sh SECONDS [TARGET...]. SEED= makes the
# same inputs again. Fails with the
# name of a target and the input that it fails on. Inputs that reach new code go to
# target/fuzz/corpus; the corpora beside this script are only read.
set -euo pipefail
cd "$(dirname "$0")/.."

seconds=$1
targets=("${@:2}")
[ ${#targets[@]} -gt 0 ] || targets=($(cd fuzz/corpus && ls))
cargo=${CARGO:-cargo}
work=target/fuzz
built=$work/build/release

# The crates of others are those of the product, so that they are compiled once.
if [ ! -d "$built" ] && [ -d target/release/deps ]; then
    mkdir -p "$built/deps"
    cp -a target/release/build target/release/.fingerprint "$built/"
    find target/release/deps -type f ! -name "*meshmark*" \( -name "*.r*" -o -name "*.d" -o -name "*.so" \) \
        -exec cp -a -t "$built/deps" {} +
fi
RUSTC_WORKSPACE_WRAPPER=$PWD/fuzz/rustc.sh "$cargo" build --release --locked -p meshmark-fuzz --target-dir "$work/build" \
    "${targets[@]/#/--bin=}"

memory=/dev/shm
[ -w "$memory" ] || memory=${TMPDIR:-/tmp}
TMPDIR=$(mktemp -d "$memory/meshmark-fuzz.XXXXXX")
export TMPDIR
pids=()
finish() {
    [ ${#pids[@]} -eq 0 ] || kill "${pids[@]}" 2>/dev/null || true
    rm -rf "$TMPDIR"
}
trap finish EXIT

for target in "${targets[@]}"; do
    mkdir -p "$work/corpus/$target" "$work/failures/$target"
    # A minute is enough for any input although all targets share the processor.
    "$built/$target" ${SEED:+-seed=$SEED} -max_total_time="$seconds" -timeout=60 -rss_limit_mb=3000 -print_final_stats=1 \
        -artifact_prefix="$work/failures/$target/" "$work/corpus/$target" "fuzz/corpus/$target" \
        >"$work/$target.log" 2>&1 &
    pids+=($!)
done

failed=0
for i in "${!targets[@]}"; do
    target=${targets[i]} log=$work/${targets[i]}.log
    if wait "${pids[i]}"; then
        echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") executions"
    else
        input=$(sed -n 's/.*Test unit written to //p' "$log" | tail -1)
        echo "$target failed on ${input:-an input that was not kept}: see $log, and run $built/$target ${input}" >&2
        failed=1
    fi
done
pids=()
exit $failed
