#!/usr/bin/env bash
# Builds the wheel into OUT/wheels, installs it into a clean environment and runs its tests there:
# make_wheel.sh PYTHON OUT. The driver of target/release is what the tests compare it with.
set -euo pipefail
cd "$(dirname "$0")/.."

python=$1 out=$2
rm -rf "$out/wheels" "$out/clean"
"$python" -m venv "$out/tools"
"$out/tools/bin/python" -m pip install --quiet "maturin[zig]==1.16.0"
# The linker of zig knows old versions of the C library, so that the wheel runs with them.
CARGO_TARGET_DIR=$out/build PATH=$PWD/$out/tools/bin:$PATH "$out/tools/bin/maturin" build --quiet --release --locked \
    --zig --compatibility manylinux2014 --manifest-path python/Cargo.toml --out "$out/wheels"

"$python" -m venv "$out/clean"
"$out/clean/bin/python" -m pip install --quiet "$out"/wheels/*.whl geopandas pyogrio pyarrow
if ldd "$out"/clean/lib/python*/site-packages/meshmark/_meshmark*.so | grep -E 'gdal|geos|proj|sqlite'; then
    echo "the wheel needs a library that a user may lack" >&2
    exit 1
fi
# Not from the folder of the package, which Python would import instead of the wheel.
root=$PWD
cd "$out/clean"
bin/python -m unittest discover -s "$root/python/tests"
bin/python -c 'import doctest, sys, meshmark
from meshmark import _comparison, _distribution, _evidence, _layers, _verification
modules = (meshmark, _comparison, _distribution, _evidence, _layers, _verification)
sys.exit(any(doctest.testmod(module).failed for module in modules))'
cd "$root"
ls -l "$out"/wheels
