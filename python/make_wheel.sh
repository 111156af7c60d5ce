#!/usr/bin/env bash
# Builds the wheel into OUT/wheels, installs it into a clean environment and runs its tests there:
# make_wheel.sh PYTHON OUT. The driver of target/release is what the tests compare it with.
set -euo pipefail
cd "$(dirname "$0")/.."

python=$1 out=$2
rm -rf "$out/wheels" "$out/clean"
python/build_wheel.sh "$python" "$out"

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
bin/python -I "$root/python/run_examples.py"
cd "$root"
ls -l "$out"/wheels
