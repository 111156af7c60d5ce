#!/usr/bin/env bash
# Marks, verifies and compares in QGIS with the Python package in place of driver and command: `make wheel`
# makes it, and QGIS finds it on PYTHONPATH. The driver and the command are there only to be compared with.
# Installs QGIS where it is missing.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

shopt -s nullglob
wheels=("${WHEELS:-$root/target/python/wheels}"/*manylinux*"$(uname -m)".whl)
[ ${#wheels[@]} -eq 1 ] || fail "the wheel is missing: make wheel"
install_missing gdal-bin qgis python3-qgis qgis-providers python3-gdal python3-venv unzip
# Debian's qgis_process is a wrapper that passes an option its program does not know.
qgis_process=$(command -v qgis_process.bin || command -v qgis_process)
export QT_QPA_PLATFORM=offscreen HOME=$work/home XDG_RUNTIME_DIR=$work PYTHONDONTWRITEBYTECODE=1 PYTHONWARNINGS=ignore
chmod 700 "$work"
plugins=$HOME/.local/share/QGIS/QGIS3/profiles/default/python/plugins
make -s -C "$root" qgis QGIS_ZIP="$work/plugin.zip" >"$work/log"
mkdir -p "$plugins"
unzip -q "$work/plugin.zip" -d "$plugins"
"$qgis_process" plugins enable meshmark_qgis >"$work/log" 2>&1 || fail "the plugin cannot be enabled: $(cat "$work/log")"

# The command of docs/qgis.md, into a folder of its own.
"${python[0]}" -m venv --system-site-packages "$work/python"
numpy=$("${python[@]}" -c 'import numpy; print(numpy.__version__)')
"$work/python/bin/python" -m pip install --quiet "numpy==$numpy" "${wheels[@]}"
packages=("$work"/python/lib/python*/site-packages)

# run ALGORITHM NAME=VALUE...: without driver and command; leaves the exit code in $code.
run() {
    code=0
    GDAL_DRIVER_PATH=$work/none "$qgis_process" run "meshmark:$1" -- "${@:2}" >"$work/log" 2>&1 || code=$?
}

logged() {
    grep -qF -- "$2" "$work/log" || fail "$1: \"$2\" is not in the log: $(cat "$work/log")"
}

refused() {
    logged "$1" "$2"
    [ "$code" -ne 0 ] || fail "$1: qgis_process ends with exit code 0"
    ! grep -q Traceback "$work/log" || fail "$1: the user sees a traceback: $(cat "$work/log")"
    passed "$1 is refused"
}

mkdir "$work/none" records
! command -v meshmark >"$work/log" || fail "the command meshmark is on the path: $(cat "$work/log")"
cp "$fixture" map.gpkg
export_two=("LAYERS=$PWD/map.gpkg|layername=buildings" "LAYERS=$PWD/map.gpkg|layername=roads" KEY="$PWD/key.json"
    RECORDS="$PWD/records" RECIPIENT="ACME GmbH" OUTPUT="$PWD/acme.gpkg")
verify_one=(REFERENCE="$PWD/records/acme.reference.gpkg" SUSPECT="$PWD/acme.gpkg" KEY="$PWD/key.json"
    RECORDS="$PWD/records" EVIDENCE_MAP="$PWD/evidence.gpkg" REPORT="$PWD/report.html")

# Without the package a message names both remedies.
run export "${export_two[@]}"
refused "export without driver and package" "The GDAL driver MESHMARK is not installed"
logged "export without driver and package" "\"${python[0]}\" -m pip install numpy==$numpy meshmark-"
run verify REFERENCE="$PWD/map.gpkg" SUSPECT="$PWD/map.gpkg" KEY="$PWD/key.json" RECORDS="$PWD/records"
refused "verify without command and package" "The command meshmark is not installed"
logged "verify without command and package" "-m pip install numpy==$numpy meshmark-"

export PYTHONPATH=${packages[0]}
"$qgis_process" help meshmark:export >"$work/with_driver" 2>&1
GDAL_DRIVER_PATH=$work/none "$qgis_process" help meshmark:export >"$work/without_driver" 2>&1
diff "$work/with_driver" "$work/without_driver" || fail "the dialog is another one without the driver"
grep -q 'Displacement of the vertices by a fingerprint' "$work/without_driver" || fail "the options have no help"
passed "the dialog has the options of the driver"

run export "${export_two[@]}"
logged "export" "Marking with the Python package meshmark"
logged "export" "$PWD/records/acme.json"
verify "the copy of the package" records/acme.reference.gpkg acme.gpkg --record records/acme.json
[ "$(find . -name '.meshmark*')" = "" ] || fail "a workplace is left"
run verify "${verify_one[@]}"
logged "verify" "RECIPIENT:	ACME GmbH"
logged "verify" "VERDICT:	match"
[ "$(ogrinfo -q evidence.gpkg | cut -d' ' -f2 | tr '\n' ' ')" = "matched_vertices patches " ] || fail "the evidence map has other layers"
grep -q "ACME GmbH" report.html || fail "the report names no recipient"
run verify "${verify_one[@]}"
refused "verify, the evidence map exists" "exists: name another file"
run compare ORIGINAL="$PWD/map.gpkg" MARKED="$PWD/acme.gpkg" LAYERS=roads,buildings
logged "compare" "NEWLY_INVALID:	0"
passed "qgis_process exports, verifies and compares with the package alone"

mkdir "$work/old" "$work/old/meshmark"
echo '__version__ = "0.0.1"' >"$work/old/meshmark/__init__.py"
PYTHONPATH=$work/old run export "${export_two[@]}"
refused "a package of another version" "is not that of version"

cp "$root/fixtures/europe_deg.gpkg" europe.gpkg
ogr2ogr -t_srs EPSG:4326 degrees.gpkg map.gpkg
PATH=$build:$PATH "${python[@]}" "$hosts/in_qgis_package.py" "$plugins" 2>"$work/log" || fail "$(cat "$work/log")"
! grep -q Traceback "$work/log" || fail "the user sees a traceback: $(cat "$work/log")"
GDAL_DRIVER_PATH=$work/none timeout 300 "${python[@]}" "$hosts/in_qgis_dialogs.py" "$plugins" 2>"$work/log" || fail "$(cat "$work/log")"
