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
PATH=$(dirname "$meshmark"):$PATH
ogr2ogr -spat 385000 6671000 385820 6673000 sheets/west.gpkg "$root/fixtures/helsinki.gpkg"
ogr2ogr -spat 385820 6671000 387000 6673000 sheets/east.gpkg "$root/fixtures/helsinki.gpkg"
run mark_folder.sh "$examples/mark_folder.sh" sheets key.json "ACME GmbH" marked private
for sheet in west east; do
    verify "mark_folder.sh" "private/$sheet.gpkg" "marked/$sheet.gpkg" --record "private/$sheet.json"
done
[ "$(ls marked)" = $'east.gpkg\nwest.gpkg' ] || fail "mark_folder.sh puts more than copies to the copies"
run "mark_folder.sh again" "$examples/mark_folder.sh" sheets key.json "ACME GmbH" marked private
for folders in "sheets/. private" "marked sheets/." "marked marked/."; do
    ! "$examples/mark_folder.sh" sheets key.json "ACME GmbH" $folders 2>"$work/log" || fail "mark_folder.sh takes $folders"
done

cp "$examples/mapserver.map" .
printf 'CONFIG\n  ENV\n    MS_MAP_PATTERN "."\n  END\nEND\n' >mapserver.conf
export MAPSERVER_CONFIG_FILE=$PWD/mapserver.conf
query="map=$PWD/mapserver.map&SERVICE=WFS&VERSION=2.0.0&REQUEST=GetFeature&TYPENAMES=buildings&OUTPUTFORMAT=geopackage"
mapserv -nh "QUERY_STRING=$query" >served.gpkg 2>"$work/log" || fail "mapserver.map: $(cat "$work/log")"
head -c 15 served.gpkg | grep -q SQLite || fail "mapserver.map: $(head -c 2000 served.gpkg)"
verify "mapserver.map" map.gpkg served.gpkg --recipient "customers of the map service"
