#!/usr/bin/env bash
# Marks with the GDAL of Python: by the examples of docs/driver.md, and when something fails.
# Installs python3-gdal where it is missing.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

install_missing gdal-bin python3-gdal
"${python[@]}" -c 'from osgeo import gdal; print("Python with GDAL", gdal.VersionInfo("RELEASE_NAME"))'
cp "$fixture" map.gpkg
ogr2ogr -f "ESRI Shapefile" map.shp map.gpkg buildings -select osm_id

sed -n '/^```python$/,/^```$/{//!p}' "$root/docs/driver.md" >"$work/example.py"
grep -q VectorTranslate "$work/example.py" || fail "docs/driver.md has no example for Python"
"${python[@]}" "$work/example.py" 2>"$work/log" || fail "the example of docs/driver.md fails: $(cat "$work/log")"
verify "the example that reads" map.gpkg marked.fgb --recipient B
verify "the example that writes" reference.gpkg marked.gpkg --recipient B

"${python[@]}" "$hosts/in_python.py" 2>"$work/log" || fail "$(cat "$work/log")"
verify "gdal.VectorTranslate that writes" written.reference.gpkg written.gpkg --record written.json
