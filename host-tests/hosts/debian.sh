#!/usr/bin/env bash
# Runs the tests, and the QGIS plugin with qgis_plugin.sh, in a clean Debian of another suite with its
# GDAL and its QGIS. Installs debootstrap where it is missing, and needs root, or
# sudo.
# Usage: debian.sh SUITE
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
source "$hosts/clean_debian.sh"

[ $# -eq 1 ] || fail "name a suite of Debian, such as trixie"
suite=$1 host="$host $1" debian=$work/debian
install_missing debootstrap
new_root "$suite" "$debian"
mounts=("$(rustc --print sysroot) /opt/rust" "$root /meshmark")

# here WHAT COMMAND: runs in the checkout, whose programs are kept apart from those for this machine's
# GDAL.
here() {
    in_root "$debian" "$1" "cd /meshmark && export CARGO_TARGET_DIR=/meshmark/target/$suite && $2"
}

here "git and make" "apt-get update -q && apt-get install -y -q --no-install-recommends ca-certificates git make"
# Of what it prints, a failure shows the last lines: those of tests that pass are not among them.
passing='^$|^running |^test result: ok|^test .* ok$|^ +(Running|Doc-tests|Compiling) '
tests=target/$suite/tests.log
mkdir -p "$root/target/$suite"
here "make test" "set -o pipefail && make -s test BUILD=target/$suite/release 2>&1 | tee $tests | { grep -vE '$passing' || true; }"
here "GDAL" "ogr2ogr --version"
passed "$(awk '/^test result: ok/ { n += $4 } END { print n }' "$root/$tests") tests with $(tail -n 1 "$work/log")"
here "the QGIS plugin" "host-tests/hosts/qgis_plugin.sh"
grep '^passed' "$work/log"
here "QGIS" "dpkg-query -W -f '\${Version}' qgis"
passed "the plugin in QGIS $(cat "$work/log")"
