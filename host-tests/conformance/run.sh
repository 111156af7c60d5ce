#!/usr/bin/env bash
# Runs test_ogrsf, GDAL's own conformance test of vector drivers, on maps read through MESHMARK.
#
#   run.sh         build test_ogrsf if necessary, then run it; needs the plugin and the command line
#                  tool, both built in release mode
#   run.sh build   only build test_ogrsf
#   run.sh with P  run P, the test_ogrsf of another GDAL, whose ogr2ogr comes first in PATH
#
# Debian packages no test_ogrsf: it is compiled here, once, from the source package of the very
# libgdal-dev that is installed. All files go to target/conformance; apt's configuration, lists and
# caches are private to it, so those of the system stay unchanged.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
target=${CARGO_TARGET_DIR:-$root/target}
work=$target/conformance
mirror=${DEBIAN_MIRROR:-http://deb.debian.org}

fail() {
    echo "conformance: $*" >&2
    exit 1
}

need() {
    command -v "$1" >/dev/null || fail "$1 is missing: apt-get install $2"
}

# --- build ---------------------------------------------------------------------------------------

# Debian's "3.6.2+dfsg-1" for the library that we compile and link against.
source_version() {
    dpkg-query --show --showformat '${source:Version}' libgdal-dev 2>/dev/null ||
        fail "libgdal-dev is missing: apt-get install libgdal-dev"
}

write_sources_list() {
    local suite area
    # shellcheck source=/dev/null
    suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
    for area in "debian $suite" "debian $suite-updates" "debian-security $suite-security"; do
        echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror/$area main"
    done
}

# Hooks on updates are cleared because they work on the system's caches: container images delete
# them there.
write_apt_configuration() {
    cat <<END
Dir::Etc::sourcelist "$work/apt/sources.list";
Dir::Etc::sourceparts "/dev/null";
Dir::State::lists "$work/apt/lists";
Dir::Cache "$work/apt/cache";
APT::Sandbox::User "$(id -un)";
#clear APT::Update::Pre-Invoke;
#clear APT::Update::Post-Invoke;
#clear APT::Update::Post-Invoke-Success;
END
}

download_source() {
    mkdir -p "$work/apt/lists/partial" "$work/apt/cache/archives/partial" "$work/source"
    write_sources_list >"$work/apt/sources.list"
    write_apt_configuration >"$work/apt/apt.conf"
    apt-get -qq -c "$work/apt/apt.conf" update
    (cd "$work/source" && apt-get -qq -c "$work/apt/apt.conf" source --download-only "gdal=$1")
}

compile() {
    local apps=$work/source/apps
    tar -xf "$work/source/gdal_${1%-*}.orig.tar.xz" -C "$work/source" --strip-components=1 \
        --wildcards '*/apps/test_ogrsf.cpp' '*/apps/commonutils.*'
    # -w: the deprecations it warns of are not ours to mend.
    # shellcheck disable=SC2046  # gdal-config prints several arguments
    g++ -O1 -std=c++17 -w $(gdal-config --cflags) -I"$apps" \
        "$apps/test_ogrsf.cpp" "$apps/commonutils.cpp" $(gdal-config --libs) -o "$2.unfinished"
    mv "$2.unfinished" "$2"
}

check_versions() {
    local library
    library=$(gdal-config --version)
    [[ $1 == "$library"[+-]* ]] || fail "gdal-config says $library, but libgdal-dev is $1"
    [[ $("$2" --utility_version) == *"compiled against GDAL $library and is running against GDAL $library"* ]] ||
        fail "$2 does not run against GDAL $library"
}

# Sets test_ogrsf. The version is in the name: an upgraded library gets a program of its own.
build() {
    need g++ g++
    need gdal-config libgdal-dev
    local version
    version=$(source_version)
    test_ogrsf=$work/test_ogrsf-$version
    if [[ ! -x $test_ogrsf ]]; then
        echo "building test_ogrsf $version"
        download_source "$version"
        compile "$version" "$test_ogrsf"
    fi
    check_versions "$version" "$test_ogrsf"
}

# --- run -----------------------------------------------------------------------------------------

# check NAME ARGUMENT...: test_ogrsf must exit with 0, test a layer and print no error.
check() {
    local log=$work/$1.log status=0
    "$test_ogrsf" -ro "${@:2}" >"$log" 2>&1 || status=$?
    grep '^WARNING' "$log" || true
    ((status == 0)) && ! grep -qE 'ERROR|FAILURE' "$log" && grep -q 'Testing layer' "$log"
}

# check_map NAME MAP: through MESHMARK. Only when that fails does it matter whether the map's own
# driver does too: that of GeoPackage in GDAL 3.12.1 does, over a count with two filters.
check_map() {
    if GDAL_DRIVER_PATH=$plugins check "$1-meshmark" "MESHMARK:$2" \
        -oo KEY="$scratch/key.json" -oo RECIPIENT="conformance test"; then
        echo "passed: $1, $(grep -c 'Testing layer' "$work/$1-meshmark.log") layer(s)"
        return
    fi
    cat "$work/$1-meshmark.log" >&2
    check "$1-native" "$2" || echo "conformance: without MESHMARK, $1 fails too: $work/$1-native.log" >&2
    fail "test_ogrsf fails on $1 (the output above is in $work/$1-meshmark.log)"
}

make_shapefile() {
    ogr2ogr -f "ESRI Shapefile" "$1" "$fixture" buildings >"$work/ogr2ogr.log" 2>&1 ||
        fail "ogr2ogr cannot make a Shapefile of $fixture: $(cat "$work/ogr2ogr.log")"
}

run() {
    plugins=$target/release/gdalplugins
    fixture=$root/fixtures/helsinki.gpkg
    [[ -f $plugins/ogr_MESHMARK.so ]] || fail "$plugins/ogr_MESHMARK.so is missing: make it first"
    need ogr2ogr gdal-bin
    scratch=$(mktemp -d)
    trap 'rm -rf "$scratch"' EXIT
    "$target/release/meshmark" keygen "$scratch/key.json"
    make_shapefile "$scratch/buildings.shp"
    check_map geopackage "$fixture"
    check_map shapefile "$scratch/buildings.shp"
}

if [[ ${1:-} == with ]]; then
    test_ogrsf=$2
    mkdir -p "$work"
else
    build
fi
[[ ${1:-} == build ]] || run
