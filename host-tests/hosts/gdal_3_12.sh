#!/usr/bin/env bash
# Builds GDAL 3.12 where it is missing, then driver and command with it, and runs on it the tests of
# every crate that uses GDAL, and test_ogrsf. Also runs each of the two GDALs with the driver of
# the other.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

folder=$root/target/gdal-3.12
gdal=$folder/gdal
wheel=$root/target/wheel/python/bin/python
crates=(-p meshmark-dataset -p meshmark-plugin -p meshmark-verifier -p meshmark-host-tests -p meshmark-cgal)

# with_3_12 COMMAND...: runs it with programs, headers and libraries of GDAL 3.12.
with_3_12() {
    env -u GDAL_DRIVER_PATH PATH="$gdal/bin:$PATH" LD_LIBRARY_PATH="$gdal/lib" PKG_CONFIG_PATH="$gdal/lib/pkgconfig" \
        CARGO_TARGET_DIR="$folder/target" "$@"
}

# refused WHAT PLUGINS SENTENCE COMMAND...: without a driver to mark it, no map is written.
refused() {
    ! GDAL_DRIVER_PATH=$2 "${@:4}" -f GPKG refused.gpkg MESHMARK:map.gpkg -oo KEY=key.json -oo RECIPIENT=B >"$work/log" 2>&1 ||
        fail "$1 marks"
    grep -q "$3" "$work/log" || fail "$1 does not say why it does not mark: $(cat "$work/log")"
    [ ! -e refused.gpkg ] || fail "$1 leaves a file"
    passed "$1: $(grep -m 1 -o "$3.*" "$work/log")"
}

if [ ! -x "$gdal/bin/test_ogrsf" ]; then
    [ -x "$wheel" ] || fail "GDAL's data are missing, which are taken from a wheel: make plugin-for-wheel"
    "$hosts/build_gdal.sh" "$gdal" "$("$wheel" -c 'import os, pyogrio; print(os.path.dirname(pyogrio.__file__) + "/gdal_data")')"
fi
[[ $(with_3_12 ogr2ogr --version) == "GDAL 3.12."* ]] || fail "$gdal is not GDAL 3.12"
with_3_12 make -s -C "$root" build BUILD="$folder/target/release"
with_3_12 ldd "$folder/target/release/meshmark" | grep -q "$gdal/lib/libgdal" || fail "the command is not linked with GDAL 3.12"
(cd "$root" && with_3_12 "${CARGO:-cargo}" test --release --locked --no-fail-fast "${crates[@]}") >"$work/tests" 2>&1 ||
    fail "$(grep -vE '^test .* ok$' "$work/tests")"
passed "$(awk '/^test result: ok/ { n += $4 } END { print n }' "$work/tests") tests with $(with_3_12 ogr2ogr --version)"
with_3_12 "$root/host-tests/conformance/run.sh" with "$gdal/bin/test_ogrsf"

cp "$fixture" map.gpkg
system=$(gdal-config --version | cut -d . -f 1,2)
other=$folder/target/release/gdalplugins
compiled="MESHMARK was compiled against GDAL"
refused "3.12 with the driver for $system" "$GDAL_DRIVER_PATH" "$compiled $system, but the current library version is 3.12" \
    "$gdal/bin/ogr2ogr"
refused "$system with the driver for 3.12" "$other" "$compiled 3.12, but the current library version is $system" \
    env LD_LIBRARY_PATH="$gdal/lib" ogr2ogr
refused "$system with the driver for 3.12, which is not installed" "$other" "libgdal.so.*: cannot open shared object file" ogr2ogr
