#!/usr/bin/env bash
# Prints the licences of the crates that are part of driver and command, as those crates carry them.
# Usage: licences.sh
set -euo pipefail

cd "$(dirname "$0")/.."
echo "The driver MESHMARK and the command meshmark contain these crates, from https://crates.io."
"${CARGO:-cargo}" tree --locked --edges normal --package meshmark-plugin --package meshmark-verifier --no-dedupe \
    --prefix none --format '{p}|{l}|{r}' | grep -v '(/' | LC_ALL=C sort -u |
    while IFS='|' read -r crate licence repository; do
        [ -n "$crate" ] || continue
        read -r name version _ <<<"$crate"
        folder=$(echo "${CARGO_HOME:-$HOME/.cargo}"/registry/src/*/"$name-${version#v}")
        printf '\n%s\n%s %s, %s, %s\n' "$(printf '=%.0s' {1..79})" "$name" "${version#v}" "$licence" "$repository"
        sed -n '/^authors = \[/,/\]/p' "$folder/Cargo.toml" | tr -d '\n[]"' | sed 's/^authors = */Authors: /; s/  */ /g; s/,$//; a\'
        find "$folder" -maxdepth 1 -type f -iregex '.*/\(un\)?\(licen[cs]e\|copying\|copyright\|notice\).*' | LC_ALL=C sort |
            while read -r text; do
                printf -- '\n--- %s\n' "$(basename "$text")"
                tr -d '\r' <"$text"
            done
    done
