#!/usr/bin/env bash
# Times a newcomer's path in clean Debians: from a clone to the end of `make demo`, from the package
# to the first marked file, from a suspect to its report. Rust exists from the start, everything
# else is fetched. Installs debootstrap where it is missing, and needs root, or sudo, for the clean
# roots.
# Usage: newcomer.sh
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
fail() {
    echo "newcomer: $*" >&2
    exit 1
}
work=$(mktemp -d)
source "$root/host-tests/hosts/clean_debian.sh"
"$root/install-deps.sh" debootstrap git
developer=$work/developer user=$work/user
new_root bookworm "$developer"
"${as_root[@]}" cp -a "$developer" "$user"

# step WHAT FOLDER COMMAND: runs it and prints the seconds.
step() {
    in_root "$2" "$1" "$3"
    printf '%5d s  %s\n' "$seconds" "$1"
}

mounts=("$(rustc --print sysroot) /opt/rust" "$root /origin")
in_root "$developer" "git and make" "apt-get update -q && apt-get install -y -q --no-install-recommends git make ca-certificates"
step "clean machine with Rust, git and make, a clone: make demo" "$developer" \
    "git -c safe.directory='*' clone -q /origin meshmark && cd meshmark && make demo"
step "make deb" "$developer" "cd meshmark && make deb"
"${as_root[@]}" cp "$developer"/root/meshmark/target/deb/*.deb "$developer/root/meshmark/fixtures/helsinki.gpkg" "$user/root/"

mounts=()
step "package, nothing else installed: apt-get, keygen, first marked file" "$user" "apt-get update -q &&
    apt-get install -y -q --no-install-recommends gdal-bin ./*.deb && meshmark keygen key.json &&
    ogr2ogr -f GPKG marked.gpkg MESHMARK:helsinki.gpkg -oo KEY=key.json -oo RECIPIENT='ACME GmbH' -oo RECORD=acme.json"
step "suspect: the report, and the comparison for its quality" "$user" "ogr2ogr -f GPKG suspect.gpkg marked.gpkg -simplify 0.25 &&
    meshmark verify --key key.json --reference helsinki.gpkg --record acme.json --report report.html suspect.gpkg &&
    meshmark compare --report quality.html helsinki.gpkg marked.gpkg && test -s report.html && test -s quality.html"
