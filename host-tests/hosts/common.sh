# Sourced by the scripts of this folder: changes into a new folder with two keys, and selects the
# driver of target/release. The output of programs is kept beside that folder.
set -euo pipefail

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
hosts=$root/host-tests/hosts
build=${CARGO_TARGET_DIR:-$root/target}/release
meshmark=$build/meshmark
fixture=$root/fixtures/kotka.gpkg
host=$(basename "$0" .sh)
# The distribution's Python is the one that the distribution's packages extend.
python=(/usr/bin/python3 -B)

fail() {
    echo "$host: $*" >&2
    exit 1
}

passed() {
    echo "passed: $host: $*"
}

# install_missing PACKAGE...
install_missing() {
    local missing=() package
    for package in "$@"; do
        dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] && return
    local as_root=()
    [ "$(id -u)" -eq 0 ] || as_root=(sudo)
    echo "installing ${missing[*]}"
    "${as_root[@]}" apt-get update -q
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
}

# verify WHAT REFERENCE SUSPECT OPTION...; options name the expected result: --record FILE or
# --recipient NAME.
verify() {
    local what=$1 reference=$2 suspect=$3
    "$meshmark" verify --key key.json --reference "$reference" "${@:4}" "$suspect" >"$work/verify.log" 2>&1 ||
        fail "$what: $suspect does not verify: $(cat "$work/verify.log")"
    # Stiff shapes show many of the signs weakly, how many depends on the key: "of 3136 secret signs of the
    # recipient 1961 agree; by chance 1568 ± 28 would" is far from chance all the same.
    awk '/^signs:/ && $8 == "recipient" { ok = $9 - $13 > 10 * $15 } END { exit !ok }' "$work/verify.log" ||
        fail "$what: signs of $suspect are wrong: $(cat "$work/verify.log")"
    passed "$what: $suspect verifies against $reference"
}

[ -f "$build/gdalplugins/ogr_MESHMARK.so" ] || fail "the driver is missing: make build"
export GDAL_DRIVER_PATH=$build/gdalplugins
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/maps"
cd "$work/maps"
"$meshmark" keygen key.json >"$work/keygen.log"
echo '{"secret": "of another program"}' >wrong.json
