#!/usr/bin/env bash
# Builds GDAL 3.12.1 with its programs and test_ogrsf into a new folder: the drivers that the tests
# use, on Debian's libraries. Installs missing packages. Takes half an hour on two cores.
# Usage: build_gdal.sh FOLDER DATA: DATA is the data folder of another GDAL 3.12, as the crate of
# gdal_source.sh lacks some of its files.
set -euo pipefail

readonly drivers=(GPKG SQLITE FLATGEOBUF CSV GML KML LIBKML TAB DXF VRT OSM MVT) # and Shapefile, GeoJSON, MEM, GTiff: always built
readonly libraries=(ZLIB JSONC TIFF GEOTIFF GEOS SQLITE3 SPATIALITE EXPAT ICONV LIBKML)

root=$(cd "$(dirname "$0")/../.." && pwd)
mkdir -p "$(dirname "$1")"
folder=$(cd "$(dirname "$1")" && pwd)/$(basename "$1")
work=$folder.unfinished
log=$folder.log

"$root/install-deps.sh" cmake ninja-build curl
rm -rf "$work"
mkdir "$work"
"$root/packaging/gdal_source.sh" "$work/source"
mkdir -p "$work/source/ogr/ogrsf_frmts/gml/data"
cp "$2"/{*.gfs,gfs.xsd,gml_registry.*} "$work/source/ogr/ogrsf_frmts/gml/data/"
mkdir -p "$work/source/ogr/ogrsf_frmts/osm/data"
cp "$2"/osmconf.ini "$work/source/ogr/ogrsf_frmts/osm/data/"

options=(-DCMAKE_BUILD_TYPE=Release -DCMAKE_C_FLAGS_RELEASE="-O1 -DNDEBUG" -DCMAKE_CXX_FLAGS_RELEASE="-O1 -DNDEBUG"
    -DCMAKE_INSTALL_PREFIX="$folder" -DCMAKE_INSTALL_LIBDIR=lib -DCMAKE_INSTALL_RPATH="$folder/lib"
    -DBUILD_TESTING=OFF -DBUILD_PYTHON_BINDINGS=OFF -DBUILD_JAVA_BINDINGS=OFF -DBUILD_CSHARP_BINDINGS=OFF
    -DENABLE_GNM=OFF -DGDAL_ENABLE_ALGORITHMS=OFF -DGDAL_USE_EXTERNAL_LIBS=OFF -DGDAL_USE_INTERNAL_LIBS=OFF
    -DGDAL_BUILD_OPTIONAL_DRIVERS=OFF -DOGR_BUILD_OPTIONAL_DRIVERS=OFF
    -DGDAL_ENABLE_DRIVER_MBTILES=ON
    "${libraries[@]/#/-DGDAL_USE_}" "${drivers[@]/#/-DOGR_ENABLE_DRIVER_}")
for i in "${!options[@]}"; do
    [[ ${options[i]} == *=* ]] || options[i]+==ON
done
cmake -S "$work/source" -B "$work/build" -G Ninja "${options[@]}" >"$log" 2>&1 &&
    nice ninja -C "$work/build" install >>"$log" 2>&1 || {
    tail -n 20 "$log" >&2
    echo "build_gdal.sh: GDAL does not build; all that was said is in $log" >&2
    exit 1
}
# This program is not installed; LD_LIBRARY_PATH names the library where it is started.
cp "$work/build/apps/test_ogrsf" "$folder/bin/"
rm -rf "$work" "$log"
