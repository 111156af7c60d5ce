#!/usr/bin/env bash
# Marks in QGIS, without a screen: layers that PyQGIS reads and writes, and the algorithm
# gdal:convertformat. Installs QGIS where it is missing.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

install_missing gdal-bin qgis python3-qgis qgis-providers
# Debian's qgis_process is a wrapper that passes an option its program does not know.
qgis_process=$(command -v qgis_process.bin || command -v qgis_process)
export QT_QPA_PLATFORM=offscreen HOME=$work/home XDG_RUNTIME_DIR=$work
mkdir "$HOME"
cp "$fixture" map.gpkg

"${python[@]}" "$hosts/in_qgis.py" 2>"$work/log" || fail "$(cat "$work/log")"
verify "a layer that is exported" map.gpkg exported.gpkg --recipient B
verify "QgsVectorFileWriter, GeoPackage" written.gpkg.reference.gpkg written.gpkg --record written.gpkg.json
verify "QgsVectorFileWriter, Shapefile" written.shp.reference.gpkg written.shp --record written.shp.json
verify "QgsVectorFileWriter, OVERWRITE=YES" replaced.reference.gpkg replaced.gpkg --record replaced.json

# convert INPUT OUTPUT OPTIONS. The layer "roads through MESHMARK" is one of the project that
# in_qgis.py saved. The exit code is 0 with and without an output.
convert() {
    "$qgis_process" run gdal:convertformat --project_path="$PWD/map.qgs" -- \
        INPUT="$1" OUTPUT="$2" OPTIONS="$3" >"$work/log" 2>&1 || true
}

# refused WHAT NAME SENTENCE: no file that begins with NAME, a pattern, is there, and the log has
# the reason.
refused() {
    grep -q "$3" "$work/log" || fail "$1: the log lacks the reason: $(cat "$work/log")"
    [ -z "$(find . -name "$2*" -o -name '.meshmark-*')" ] || fail "$1: files are left: $(ls -A)"
    passed "$1: nothing is left"
}

open="-oo RECIPIENT=B -oo RECORD=$PWD"
create="-f MESHMARK -dsco RECIPIENT=B -dsco REFERENCE=$PWD"
convert "roads through MESHMARK" "$PWD/converted.gpkg" "-oo KEY=$PWD/key.json $open/converted.json"
verify "gdal:convertformat that reads" map.gpkg converted.gpkg --record converted.json
convert "$PWD/map.gpkg|layername=buildings" "MESHMARK:$PWD/last_step.gpkg" \
    "-dsco KEY=$PWD/key.json $create/last_step.reference.gpkg -dsco RECORD=$PWD/last_step.json"
verify "gdal:convertformat that writes" last_step.reference.gpkg last_step.gpkg --record last_step.json

convert "roads through MESHMARK" "$PWD/unmarked.gpkg" ""
refused "gdal:convertformat that reads, without options" unmarked "neither RECIPIENT nor MESSAGE is given"
convert "roads through MESHMARK" "$PWD/wrong.gpkg" "-oo KEY=$PWD/wrong.json $open/wrong.record.json"
refused "gdal:convertformat that reads, a wrong key file" "wrong.[gr]" "wrong.json is not usable"
convert "$PWD/map.gpkg|layername=buildings" "MESHMARK:$PWD/wrong.gpkg" \
    "-dsco KEY=$PWD/wrong.json $create/wrong.reference.gpkg"
refused "gdal:convertformat that writes, a wrong key file" "wrong.[gr]" "wrong.json is not usable"
