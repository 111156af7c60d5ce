#!/usr/bin/env bash
# Marks a real map on export, verifies it, attacks it once, and verifies it again.
# Usage: GDAL_DRIVER_PATH=<folder of ogr_MESHMARK.so> demo.sh <meshmark> <map.gpkg>
set -euo pipefail

meshmark=$1 map=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

bold='' plain=''
if [ -t 1 ]; then bold=$'\033[1m' plain=$'\033[0m'; fi
run() {
    printf '\n%s$ %s%s\n' "$bold" "$*" "$plain"
    "$@"
}

echo "A key, and a copy of $map for ACME GmbH:"
run "$meshmark" keygen "$work/key.json"
run ogr2ogr -f GPKG "$work/marked.gpkg" "MESHMARK:$map" \
    -oo KEY="$work/key.json" -oo RECIPIENT="ACME GmbH" -oo RECORD="$work/acme.json"

printf '\nIs the marked map a copy for ACME GmbH?\n'
run "$meshmark" verify --key "$work/key.json" --reference "$map" --record "$work/acme.json" "$work/marked.gpkg"

printf '\nThe map leaks: only buildings and roads are left, simplified by 0.25 m, cut to a quarter, as GeoJSON in degrees.\n'
read -r west south east north < <(ogrinfo -ro -so "$map" buildings |
    sed -n 's/^Extent: (\(.*\), \(.*\)) - (\(.*\), \(.*\))$/\1 \2 \3 \4/p')
middle_x=$(awk "BEGIN { print ($west + $east) / 2 }") middle_y=$(awk "BEGIN { print ($south + $north) / 2 }")
for layer in buildings roads; do
    run ogr2ogr -f GeoJSON "$work/$layer.geojson" "$work/marked.gpkg" "$layer" \
        -spat "$west" "$south" "$middle_x" "$middle_y" -simplify 0.25 -t_srs EPSG:4326
    run ogr2ogr -f GPKG -append "$work/leaked.gpkg" "$work/$layer.geojson" -nln "$layer" -nlt GEOMETRY
done

printf '\nWhose copy was it?\n'
run "$meshmark" verify --key "$work/key.json" --reference "$map" --record "$work/acme.json" "$work/leaked.gpkg"

printf '\nAnd does the unmarked map look marked?\n'
run "$meshmark" verify --key "$work/key.json" --reference "$map" --record "$work/acme.json" "$map" || [ $? -eq 1 ]
