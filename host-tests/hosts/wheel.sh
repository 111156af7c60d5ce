#!/usr/bin/env bash
# Marks with geopandas and the GDAL 3.12 in pyogrio's wheel; `make plugin-for-wheel` makes both it
# and the driver for it.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

wheel=$root/target/wheel
[ -f "$wheel/gdalplugins/ogr_MESHMARK.so" ] || fail "the driver for the wheel is missing: make plugin-for-wheel"
cp "$fixture" map.gpkg
ogr2ogr -f GPKG marked_by_system.gpkg MESHMARK:map.gpkg -oo KEY=key.json -oo RECIPIENT="ACME GmbH" \
    -oo RECORD=marked_by_system.json
GDAL_DRIVER_PATH=$wheel/gdalplugins "$wheel/python/bin/python" -B "$hosts/in_wheel.py" >"$work/log" 2>&1 ||
    fail "$(cat "$work/log")"
passed "$("$wheel/python/bin/python" -c 'import pyogrio; print("GDAL", *pyogrio.__gdal_version__)') marks like the system's GDAL, $(grep -c refused "$work/log") bad requests refused"
verify "reading" map.gpkg read.gpkg --record read.json
verify "writing" written.reference.gpkg written.gpkg --record written.json
