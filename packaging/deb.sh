#!/usr/bin/env bash
# Makes a Debian package of what `make build` built: driver, command, man pages, completions,
# documents.
# Usage: deb.sh BUILD_FOLDER OUTPUT_FOLDER; prints the path of the package.
set -euo pipefail

root=$(cd "$(dirname "$0")/.." && pwd)
build=$1 output=$2
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' "$root/Cargo.toml" | head -n 1)-1
maintainer="meshmark <meshmark@localhost>"
architecture=$(dpkg --print-architecture)
libraries=usr/lib/$(dpkg-architecture -qDEB_HOST_MULTIARCH)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
tree=$work/tree

install -D -m 644 "$build/gdalplugins/ogr_MESHMARK.so" "$tree/$libraries/gdalplugins/ogr_MESHMARK.so"
install -D -m 755 "$build/meshmark" "$tree/usr/bin/meshmark"
strip --strip-unneeded "$tree/$libraries/gdalplugins/ogr_MESHMARK.so" "$tree/usr/bin/meshmark"

"$build/meshmark" package-files "$work/generated"
install -d "$tree/usr/share/man/man1"
for page in "$work"/generated/*.1; do
    gzip -9n <"$page" >"$tree/usr/share/man/man1/$(basename "$page").gz"
done
install -D -m 644 "$work/generated/meshmark.bash" "$tree/usr/share/bash-completion/completions/meshmark"
install -D -m 644 "$work/generated/_meshmark" "$tree/usr/share/zsh/vendor-completions/_meshmark"
install -D -m 644 "$work/generated/meshmark.fish" "$tree/usr/share/fish/vendor_completions.d/meshmark.fish"

# With all that the documents link to and that their examples use.
documents=$tree/usr/share/doc/meshmark
install -d "$documents"
(cd "$root" && cp -r --parents {README,ARCHITECTURE,CHANGELOG}.md docs examples fixtures/{SOURCES.md,vectors,kotka.gpkg,helsinki.gpkg} \
    plugin/include/meshmark.h benches/peers/mesh_spectral.py "$documents")
gzip -9n <"$root/CHANGELOG.md" >"$documents/changelog.gz"
gzip -9n >"$documents/changelog.Debian.gz" <<END
meshmark ($version) unstable; urgency=medium

  * What changed is in changelog.gz.

 -- $maintainer  $(date -R -u -r "$root/CHANGELOG.md")
END
install -m 644 "$root/packaging/copyright" "$documents/copyright"
"$root/packaging/licences.sh" | gzip -9n >"$documents/licences.gz"
install -D -m 644 "$root/plugin/include/meshmark.h" "$tree/usr/include/meshmark.h"

# The plugin where a QGIS of Debian looks; it is enabled in the plugin manager.
qgis=$tree/usr/share/qgis/python/plugins/meshmark_qgis
install -D -m 644 -t "$qgis" "$root"/qgis/meshmark_qgis/{*.py,icon.svg,metadata.txt}

find "$tree" -type d -exec chmod 755 {} +
find "$documents" -type f -exec chmod 644 {} +

# What the programs need, with the least versions, as Debian's own packages find it out.
mkdir -p "$work/debian" "$tree/DEBIAN"
printf 'Source: meshmark\n\nPackage: meshmark\nArchitecture: any\n' >"$work/debian/control"
needs=$(cd "$work" && dpkg-shlibdeps -O "$tree/$libraries/gdalplugins/ogr_MESHMARK.so" "$tree/usr/bin/meshmark" 2>/dev/null |
    sed -n 's/^shlibs:Depends=//p')
[ -n "$needs" ] || { echo "deb.sh: dpkg-shlibdeps found no library that the programs need" >&2; exit 1; }
cat >"$tree/DEBIAN/control" <<END
Package: meshmark
Version: $version
Architecture: $architecture
Maintainer: $maintainer
Installed-Size: $(du -sk --exclude=DEBIAN "$tree" | cut -f 1)
Depends: $needs
Recommends: gdal-bin
Suggests: qgis
Section: science
Priority: optional
Description: watermarks for vector maps: GDAL driver and verifier
 The GDAL driver MESHMARK marks a vector map with its recipient while it is
 exported, by moving vertices a little, within a tolerance and without a
 change of topology. The command meshmark says whose copy a leaked map is,
 with a p-value, also when it was cut, simplified, moved or reprojected.
END
# Python keeps what it compiled beside the plugin when root runs QGIS.
install -m 755 /dev/stdin "$tree/DEBIAN/prerm" <<END
#!/bin/sh
set -e
rm -rf /usr/share/qgis/python/plugins/meshmark_qgis/__pycache__
END
(cd "$tree" && find usr -type f -exec md5sum {} + | sort -k 2) >"$tree/DEBIAN/md5sums"

mkdir -p "$output"
package=$output/meshmark_${version}_$architecture.deb
dpkg-deb --root-owner-group --build "$tree" "$package" >/dev/null
echo "$package"
