#!/usr/bin/env bash
# Runs the notebook of examples/ with the wheel of `make wheel`, which is kept without outputs.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

shopt -s nullglob
wheels=("${WHEELS:-$root/target/python/wheels}"/*manylinux*"$(uname -m)".whl)
[ ${#wheels[@]} -eq 1 ] || fail "the wheel is missing: make wheel"
install_missing python3-venv
notebook=$root/examples/meshmark.ipynb
"${python[0]}" -m venv "$work/python"
"$work/python/bin/python" -m pip install --quiet nbconvert ipykernel geopandas pyogrio "${wheels[@]}"

if grep -q '"output_type"\|"execution_count": [0-9]' "$notebook"; then
    fail "the notebook holds outputs: jupyter nbconvert --clear-output --inplace examples/meshmark.ipynb"
fi
export MESHMARK_MAP=$fixture JUPYTER_CONFIG_DIR=$work/jupyter IPYTHONDIR=$work/ipython
"$work/python/bin/jupyter" nbconvert --to html --execute "$notebook" --output-dir "$work" --output page >"$work/log" 2>&1 ||
    fail "the notebook fails: $(cat "$work/log")"
grep -q '<iframe.*srcdoc=' "$work/page.html" || fail "the notebook shows no report"
grep -q 'ACME GmbH' "$work/page.html" || fail "the notebook names nobody"
passed "the notebook marks, leaks, verifies and shows the report"
