#!/usr/bin/env bash
# Runs the examples and verifies their outputs; postgis.sh runs the one for PostGIS. Installs Python's
# GDAL and MapServer where they are missing; the driver for pyogrio's wheel is that of
# `make plugin-for-wheel`.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

examples=$root/examples
install_missing gdal-bin python3-gdal cgi-mapserver
cp "$fixture" map.gpkg

# run WHAT COMMAND...
run() {
    "${@:2}" >"$work/log" 2>&1 || fail "$1: $(cat "$work/log")"
}

run gdal_python.py "${python[@]}" "$examples/gdal_python.py" map.gpkg key.json "ACME GmbH"
verify "gdal_python.py, reading" map.gpkg read.gpkg --record read.json
verify "gdal_python.py, writing" written.reference.gpkg written.gpkg --record written.json

wheel=$root/target/wheel
GDAL_DRIVER_PATH=$wheel/gdalplugins run geopandas_export.py \
    "$wheel/python/bin/python" "$examples/geopandas_export.py" map.gpkg buildings key.json "ACME GmbH"
verify "geopandas_export.py" exported.reference.gpkg exported.gpkg --record exported.json

mkdir sheets
cp "$root/fixtures/kotka.gpkg" "$root/fixtures/helsinki.gpkg" sheets/
run mark_folder.sh "$examples/mark_folder.sh" sheets key.json "ACME GmbH" marked
for sheet in kotka helsinki; do
    verify "mark_folder.sh" "marked/$sheet.reference.gpkg" "marked/$sheet.gpkg" --record "marked/$sheet.json"
done
run "mark_folder.sh again" "$examples/mark_folder.sh" sheets key.json "ACME GmbH" marked
! "$examples/mark_folder.sh" sheets key.json "ACME GmbH" sheets/. 2>"$work/log" || fail "mark_folder.sh takes sheets for copies"

cp "$examples/mapserver.map" .
printf 'CONFIG\n  ENV\n    MS_MAP_PATTERN "."\n  END\nEND\n' >mapserver.conf
export MAPSERVER_CONFIG_FILE=$PWD/mapserver.conf
query="map=$PWD/mapserver.map&SERVICE=WFS&VERSION=2.0.0&REQUEST=GetFeature&TYPENAMES=buildings&OUTPUTFORMAT=geopackage"
mapserv -nh "QUERY_STRING=$query" >served.gpkg 2>"$work/log" || fail "mapserver.map: $(cat "$work/log")"
head -c 15 served.gpkg | grep -q SQLite || fail "mapserver.map: $(head -c 2000 served.gpkg)"
verify "mapserver.map" map.gpkg served.gpkg --recipient "customers of the map service"
