#!/usr/bin/env bash
# Opens a report in Chromium, as its readers do: there must be no error, no request, and pages of A4.
# Installs Chromium where it is missing. Writes pictures into the folder that is named:
# `host-tests/hosts/chromium.sh docs/images` draws those of the documents again.
pictures=$(realpath -m "${1:-/nonexistent}")
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

install_missing chromium fonts-liberation fonts-dejavu-core gdal-bin imagemagick poppler-utils python3

# chromium OPTION... PAGE: runs without a screen; keeps its log and its requests.
chromium() {
    local page=${*: -1}
    timeout 120 /usr/bin/chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --no-first-run \
        --user-data-dir="$work/chromium" --disable-background-networking --disable-component-update --disable-sync \
        --enable-logging=stderr --log-net-log="$work/net.json" "${@:1:$#-1}" "file://$PWD/$page" \
        >"$work/out" 2>"$work/log" || fail "Chromium fails on $page: $(tail -n 5 "$work/log")"
}

# Prints network requests of pages; Chromium makes some requests of its own.
requests() {
    "${python[@]}" - "$work/net.json" <<'END'
import json, sys
for event in json.load(open(sys.argv[1]))["events"]:
    asked = event.get("params", {})
    if "url" in asked and asked.get("initiator", "not an origin") != "not an origin":
        print(asked["url"])
END
}

console() {
    grep 'CONSOLE' "$work/log" || true
}

cp "$root/fixtures/helsinki.gpkg" reference.gpkg
cp "$root/fixtures/vectors/key.json" key.json # the same pictures every time
ogr2ogr -f GPKG marked.gpkg MESHMARK:reference.gpkg -oo KEY=key.json -oo RECIPIENT="ACME GmbH" -oo RECORD=acme.json
ogr2ogr -f GPKG -t_srs EPSG:4326 -spat 385449 6671699 385800 6672000 suspect.gpkg marked.gpkg buildings roads landuse
"$meshmark" verify --key key.json --reference reference.gpkg --record acme.json suspect.gpkg --report match.html >"$work/out"
cat >case.toml <<'END'
number = "2026/117"
examiner = "A. Example"
date = 2026-11-28
custody = ["2026-11-20 received from the police", "2026-11-27 returned"]
END
"$meshmark" verify --key key.json --reference reference.gpkg --record acme.json suspect.gpkg --case case.toml --report case.html \
    >"$work/out"
"$meshmark" verify --key key.json --reference reference.gpkg --recipient "ACME GmbH" "$fixture" --report inconclusive.html \
    >"$work/out" && fail "another map is not inconclusive"
"$meshmark" compare reference.gpkg marked.gpkg --report comparison.html >"$work/out"

# This page makes every fault, which proves that the checks below notice it.
echo '<!DOCTYPE html><title>x</title><img src="http://127.0.0.1:9/x"><script>console.error("seen")</script>' >wrong.html
chromium --screenshot="$work/wrong.png" wrong.html
[ -n "$(console)" ] && [ -n "$(requests)" ] || fail "errors and requests of a page would not be seen"

for page in match case inconclusive comparison; do
    chromium --screenshot="$work/$page.png" --window-size=900,1600 $page.html
    [ -z "$(console)" ] || fail "$page.html: $(console)"
    [ -z "$(requests)" ] || fail "$page.html requests $(requests)"
    chromium --no-pdf-header-footer --print-to-pdf="$work/$page.pdf" $page.html
    pages=$(pdfinfo "$work/$page.pdf" | awk '/^Pages:/ { print $2 }')
    pdfinfo "$work/$page.pdf" | grep -q '^Page size:.*(A4)' || fail "$page.html is not printed on A4"
    [ "$pages" -ge 3 ] && [ "$pages" -le 8 ] || fail "$page.html prints to $pages pages"
    passed "$page.html: no error, no request, $pages pages of A4"
done

# draw NAME WIDTH,HEIGHT PAGE CHROMIUM-OPTION... -- CONVERT-OPTION...
draw() {
    local name=$1 size=$2 page=$3 options=()
    shift 3
    while [ "$1" != -- ]; do options+=("$1") && shift; done
    chromium --screenshot="$work/$name.png" --window-size="$size" "${options[@]}" "$page"
    convert "$work/$name.png" "${@:2}" -strip -colors 64 "PNG8:$work/maps/report-$name.png"
}

draw desktop 900,1850 match.html --
draw dark 900,1850 match.html --blink-settings=preferredColorScheme=0 --
draw phone 390,1850 match.html --
draw grey 900,1850 match.html -- -colorspace Gray
draw comparison 900,1850 comparison.html --
draw inconclusive 900,900 inconclusive.html --
pdftoppm -r 60 -png -l 2 "$work/case.pdf" "$work/printed"
convert "$work"/printed-*.png -bordercolor grey -border 1 +append -strip -colors 64 "PNG8:report-print.png"
[ "$(pdftotext "$work/case.pdf" - | grep -c '2026/117')" -ge "$(pdfinfo "$work/case.pdf" | awk '/^Pages:/ { print $2 }')" ] ||
    fail "a printed page lacks the number of the case"
# The dark page is dark, and the grey print is grey.
brightness() { convert "report-$1.png" -colorspace Gray -format '%[fx:100*mean]' info: | cut -d. -f1; }
[ "$(brightness desktop)" -gt 70 ] && [ "$(brightness dark)" -lt 40 ] || fail "there is no dark page"
if [ -d "$pictures" ]; then cp report-*.png "$pictures"; fi
passed "desktop, dark, phone, grey and print"
