#!/usr/bin/env bash
# Installs the Debian or Ubuntu packages that are missing, those given as arguments too. Does
# nothing when all are there.
set -euo pipefail

packages=(g++ pkg-config gdal-bin libgdal-dev libsqlite3-dev libcgal-dev libgmp-dev "$@")

missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
command -v cargo >/dev/null || {
    echo "cargo is missing: install Rust 1.90 or later first, see https://rustup.rs" >&2
    exit 1
}
[ ${#missing[@]} -eq 0 ] && exit 0

command -v apt-get >/dev/null || {
    echo "these packages are missing, and there is no apt-get to install them: ${missing[*]}" >&2
    exit 1
}
as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
echo "installing ${missing[*]}"
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
