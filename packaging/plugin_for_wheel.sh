#!/usr/bin/env bash
# Builds the driver for the GDAL that a wheel of pyogrio brings along, which geopandas uses.
# Usage: plugin_for_wheel.sh PYTHON OUTPUT_FOLDER: a Python that can import pyogrio, and the folder
# for ogr_MESHMARK.so.
set -euo pipefail

# GDAL's headers, which no wheel has, are those of gdal_source.sh: its C++ interface is that of all
# of 3.12.
readonly headers_of=3.12

root=$(cd "$(dirname "$0")/.." && pwd)
python=$1
mkdir -p "$2"
output=$(cd "$2" && pwd)

version=$("$python" -c 'import pyogrio; print(".".join(map(str, pyogrio.__gdal_version__)))') || {
    echo "plugin_for_wheel.sh: $python has no pyogrio: $python -m pip install pyogrio" >&2
    exit 1
}
[[ $version == "$headers_of".* ]] || {
    echo "plugin_for_wheel.sh: pyogrio of $python has GDAL $version, and the headers here are those of $headers_of:" \
        "install a pyogrio with that, such as 0.13.0" >&2
    exit 1
}
library=$("$python" -c 'import glob, os, pyogrio
print(*glob.glob(os.path.join(os.path.dirname(pyogrio.__file__) + ".libs", "libgdal-*")))')
[ -f "$library" ] || {
    echo "plugin_for_wheel.sh: pyogrio of $python is no wheel with a GDAL of its own: use the driver of make build" >&2
    exit 1
}

home=$output/gdal-$version
if [ ! -f "$home/include/gdal_version.h" ]; then
    work=$(mktemp -d)
    trap 'rm -rf "$work"' EXIT
    source=$work/source
    "$root/packaging/gdal_source.sh" "$source"
    mkdir -p "$home/include" "$home/lib"
    cp "$source"/{port,gcore,ogr,alg,apps}/*.h "$source"/ogr/ogrsf_frmts/*.h "$home/include/"
    # What configuring GDAL would make: types of this machine, as the system's GDAL has them, and
    # the version.
    cp "$("${CC:-cc}" -E -xc - $(gdal-config --cflags) <<<'#include <cpl_config.h>' | sed -n 's/.*"\(.*cpl_config.h\)".*/\1/p' |
        head -n 1)" "$home/include/"
    cp "$source/gcore/gdal_version.h.in" "$home/include/gdal_version.h"
fi
ln -sf "$library" "$home/lib/libgdal.so"
printf '#!/bin/sh\necho "-I%s"\n' "$home/include" >"$home/gdal-config"
chmod +x "$home/gdal-config"

cd "$root"
GDAL_HOME=$home GDAL_VERSION=$version GDAL_CONFIG=$home/gdal-config CARGO_TARGET_DIR=$output/target \
    "${CARGO:-cargo}" build --release --locked -p meshmark-plugin
mkdir -p "$output/gdalplugins"
install -m 755 "$output/target/release/libmeshmark_plugin.so" "$output/gdalplugins/ogr_MESHMARK.so"
echo "the driver for GDAL $version of pyogrio is $output/gdalplugins/ogr_MESHMARK.so"
