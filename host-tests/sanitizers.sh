#!/usr/bin/env bash
# Memory errors and leaks of the driver. Its C++ is compiled with AddressSanitizer and
# UndefinedBehaviorSanitizer and runs jobs of ogr2ogr and ogrinfo, those that fail too; then valgrind
# watches the driver as users have it read one map and write one. Any report ends this with an error.
set -euo pipefail
cd "$(dirname "$0")/.."

./install-deps.sh valgrind
sanitizers=-fsanitize=address,undefined
CXXFLAGS="$sanitizers -fno-sanitize-recover=undefined -fno-omit-frame-pointer -g" \
    "${CARGO:-cargo}" build --release --locked -p meshmark-plugin --target-dir target/sanitizers
runtimes="$(g++ -print-file-name=libasan.so) $(g++ -print-file-name=libubsan.so)"

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/watched" "$work/plain"
cp target/sanitizers/release/libmeshmark_plugin.so "$work/watched/ogr_MESHMARK.so"
cp target/release/libmeshmark_plugin.so "$work/plain/ogr_MESHMARK.so"
install -m 600 fixtures/vectors/key.json "$work/key.json"
cp fixtures/{kotka,shapes,europe_deg}.gpkg "$work"
cd "$work"

# A map of one patch, which valgrind can follow.
awk 'BEGIN {
    print "{\"type\":\"FeatureCollection\",\"crs\":{\"type\":\"name\",\"properties\":{\"name\":\"EPSG:3067\"}},\"features\":["
    for (i = 0; i < 130; i++) {
        x = 385000 + i % 12 * 40 + i * i % 7; y = 6671000 + int(i / 12) * 50 + i * i % 5; e = x + 9 + i % 6; n = y + 8 + i % 5
        printf "%s{\"type\":\"Feature\",\"properties\":{\"name\":\"%d\"},\"extra\":[1],\"geometry\":{\"type\":\"Polygon\",\"coordinates\":[[[%d,%d],[%d,%d],[%d,%d],[%d,%d],[%d,%d]]]}}\n", \
            i ? "," : "", i, x, y, e, y, e, n, x, n, x, y
    }
    print "]}"
}' >houses.geojson

export GDAL_DRIVER_PATH=$work/watched GDAL_NUM_THREADS=2
# A memory error ends a job with 99; reports of undefined behaviour do, too.
export ASAN_OPTIONS=exitcode=99:detect_leaks=1:detect_odr_violation=0 UBSAN_OPTIONS=print_stacktrace=1:exitcode=99
jobs=0
# job CODE COMMAND...: runs a command that must end with this code.
job() {
    local expected=$1 code=0
    shift
    LD_PRELOAD=$runtimes "$@" >log 2>&1 || code=$?
    if [ "$code" -ne "$expected" ] || grep -q 'Sanitizer\|runtime error' log; then
        cat log
        echo "exit code $code instead of $expected: $*" >&2
        exit 1
    fi
    jobs=$((jobs + 1))
}
mark=(-oo KEY=key.json -oo "RECIPIENT=ACME GmbH")
create=(-dsco KEY=key.json -dsco "RECIPIENT=ACME GmbH")

# Reading.
for ending in gpkg geojson fgb shp; do
    job 0 ogr2ogr "read.$ending" MESHMARK:houses.geojson "${mark[@]}"
done
job 0 ogr2ogr -f GPKG reads.gpkg MESHMARK:kotka.gpkg "${mark[@]}" -oo RECORD=record.json -t_srs EPSG:4326
job 0 ogrinfo -al MESHMARK:houses.geojson "${mark[@]}" -spat 385000 6671000 385200 6671200 -where "name > '3'"
job 0 ogrinfo MESHMARK:kotka.gpkg "${mark[@]}" -sql 'SELECT COUNT(*) FROM buildings'
job 0 ogrinfo MESHMARK:houses.geojson "${mark[@]}" -fid 3 houses
job 1 ogr2ogr no.gpkg MESHMARK:missing.gpkg "${mark[@]}"
job 1 ogr2ogr no.gpkg MESHMARK:houses.geojson -oo KEY=houses.geojson -oo RECIPIENT=A
job 1 ogr2ogr no.gpkg MESHMARK:houses.geojson -oo KEY=missing.json -oo RECIPIENT=A
job 1 ogr2ogr no.gpkg MESHMARK:houses.geojson "${mark[@]}" -oo NO_SUCH=1
job 1 ogr2ogr no.gpkg MESHMARK:houses.geojson "${mark[@]}" -oo MESSAGE=00
job 1 ogr2ogr no.gpkg MESHMARK:houses.geojson "${mark[@]}" -oo PATCH_SIZE=4096
job 1 ogr2ogr no.gpkg MESHMARK:houses.geojson "${mark[@]}" -oo TOLERANCE=1000
job 0 ogr2ogr held.gpkg MESHMARK:houses.geojson "${mark[@]}" -oo TOLERANCE=1e-9
job 1 ogr2ogr -update houses.geojson MESHMARK:houses.geojson "${mark[@]}"

# Writing.
for ending in gpkg geojson fgb shp shz; do
    job 0 ogr2ogr -f MESHMARK "MESHMARK:written.$ending" houses.geojson "${create[@]}" -dsco "REFERENCE=of_$ending.gpkg"
done
job 0 ogr2ogr -f MESHMARK MESHMARK:written.geojsonl europe_deg.gpkg "${create[@]}" -dsco REFERENCE=europe.gpkg \
    -dsco TOLERANCE=3000 -dsco AMPLITUDE=300 -t_srs EPSG:4326
job 0 ogr2ogr -f MESHMARK MESHMARK:layers.gpkg kotka.gpkg "${create[@]}" -dsco REFERENCE=layers_reference.gpkg -gt 7
job 1 ogr2ogr -f MESHMARK MESHMARK:written.gpkg houses.geojson "${create[@]}" -dsco REFERENCE=again.gpkg
job 1 ogr2ogr -f MESHMARK MESHMARK:no/folder.gpkg houses.geojson "${create[@]}" -dsco REFERENCE=again.gpkg
job 1 ogr2ogr -f MESHMARK MESHMARK:no.gpkg houses.geojson "${create[@]}"
job 1 ogr2ogr -f MESHMARK MESHMARK:no.gpkg houses.geojson -dsco KEY=log -dsco RECIPIENT=A -dsco REFERENCE=again.gpkg
job 0 ogr2ogr -f MESHMARK MESHMARK:held_too.gpkg houses.geojson "${create[@]}" -dsco REFERENCE=held_reference.gpkg -dsco TOLERANCE=1e-9
job 1 ogr2ogr -f MESHMARK MESHMARK:no.pdf houses.geojson "${create[@]}" -dsco REFERENCE=again.gpkg
job 1 ogr2ogr -f MESHMARK no.gpkg houses.geojson "${create[@]}" -dsco REFERENCE=again.gpkg
job 1 ogr2ogr -f MESHMARK MESHMARK:no.fgb kotka.gpkg "${create[@]}" -dsco REFERENCE=again.gpkg
job 1 ogr2ogr -f MESHMARK MESHMARK:no.gpkg houses.geojson "${create[@]}" -dsco REFERENCE=again.gpkg -where "name = '1'"
job 1 ogr2ogr -update -f MESHMARK MESHMARK:written.gpkg houses.geojson "${create[@]}" -dsco REFERENCE=again.gpkg
job 1 bash -c 'ulimit -f 16; trap "" XFSZ; exec ogr2ogr -f MESHMARK MESHMARK:no.gpkg houses.geojson "$@"' - "${create[@]}" \
    -dsco REFERENCE=again.gpkg
echo "$jobs jobs under AddressSanitizer and UndefinedBehaviorSanitizer: no report"

export GDAL_DRIVER_PATH=$work/plain
watch() {
    valgrind --quiet --error-exitcode=99 --leak-check=full --show-leak-kinds=definite,indirect \
        --errors-for-leak-kinds=definite,indirect --num-callers=40 "$@" >log 2>&1 || { cat log; exit 1; }
}
watch ogr2ogr watched.gpkg MESHMARK:houses.geojson "${mark[@]}" -oo RECORD=watched.json
watch ogr2ogr -f MESHMARK MESHMARK:watched_written.gpkg houses.geojson "${create[@]}" -dsco REFERENCE=watched_reference.gpkg
echo "a map read and a map written under valgrind: no invalid access, no leak"
