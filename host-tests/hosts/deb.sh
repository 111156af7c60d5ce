#!/usr/bin/env bash
# Installs the Debian package into a clean root, uses it there as the README describes, and removes
# it again. Installs debootstrap where it is missing, and needs root, or sudo, for the clean root.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
source "$hosts/clean_debian.sh"

unset GDAL_DRIVER_PATH # the package's driver is to be found without it
install_missing debootstrap dpkg-dev
package=$("$root/packaging/deb.sh" "$build" "$work/package")
clean=$work/root
new_root bookworm "$clean"
"${as_root[@]}" cp "$package" "$fixture" "$clean/root/"

in_root "$clean" "installing the package" "apt-get update -q && apt-get install -y -q --no-install-recommends gdal-bin ./$(basename "$package")"
passed "$(basename "$package") installs"
in_root "$clean" "ogrinfo" "ogrinfo --formats | grep 'MESHMARK -vector-'"
passed "ogrinfo --formats lists MESHMARK"
in_root "$clean" "the README's commands" "meshmark keygen key.json &&
    ogr2ogr -f GPKG marked.gpkg MESHMARK:kotka.gpkg -oo KEY=key.json -oo RECIPIENT='ACME GmbH' -oo RECORD=acme.json &&
    meshmark verify --key key.json --reference kotka.gpkg --record acme.json marked.gpkg | grep '^verdict: *MATCH'"
passed "the README's commands mark and verify"
in_root "$clean" "the documents" "zcat /usr/share/man/man1/meshmark-verify.1.gz | grep -q records &&
    source /usr/share/bash-completion/completions/meshmark && complete -p meshmark &&
    test -s /usr/share/doc/meshmark/copyright && test -s /usr/share/zsh/vendor-completions/_meshmark"
passed "man pages and completions are there"
in_root "$clean" "the links of the documents" "cd /usr/share/doc/meshmark && find . -name '*.md' | while read -r page; do
        { grep -o '](\([^)#]*\)' \$page || true; } | sed 's/^](//' | while read -r link; do
            case \$link in '' | http*) continue ;; esac
            test -e \$(dirname \$page)/\$link || { echo \$page: \$link; exit 1; }
        done
    done"
in_root "$clean" "docs/verifier.md's example" "cd /usr/share/doc/meshmark/fixtures &&
    meshmark verify --key vectors/key.json --reference kotka.gpkg --record vectors/record.json vectors/marked.gpkg --report /root/match.html"
passed "the documents lead somewhere, and their example is a match"
in_root "$clean" "removing the package" "cp /var/lib/dpkg/info/meshmark.list list && apt-get purge -y -q meshmark && ! ogrinfo --formats | grep MESHMARK &&
    while read -r path; do test -d \"\$path\" || ! test -e \"\$path\" || exit 1; done <list && ! test -e /usr/share/doc/meshmark"
passed "removal leaves nothing"
