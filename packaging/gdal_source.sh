#!/usr/bin/env bash
# Unpacks the sources of GDAL 3.12.1, which a crate carries, as a new folder.
# Usage: gdal_source.sh FOLDER
set -euo pipefail

readonly crate=gdal-src-0.3.0+3.12.1
readonly crate_sha256=529210c62af5a747e8b268d4a527c8dd54f45a07db0682acfcc9313e869c54d3

[ ! -e "$1" ] || {
    echo "gdal_source.sh: $1 exists: name a new folder" >&2
    exit 1
}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
curl -fsSL "https://static.crates.io/crates/gdal-src/$crate.crate" -o "$work/crate"
echo "$crate_sha256  $work/crate" | sha256sum --check --quiet
tar -xzf "$work/crate" -C "$work"
mv "$work/$crate/source" "$1"
