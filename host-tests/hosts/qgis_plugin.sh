#!/usr/bin/env bash
# Installs the QGIS plugin from its zip into a profile of its own and marks, verifies and compares
# with it: by qgis_process, by PyQGIS, and in QGIS itself on a virtual screen, which takes the
# pictures of docs/qgis.md (into the folder $PICTURES when it is given). Installs QGIS and Xvfb
# where they are missing.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

install_missing gdal-bin qgis python3-qgis qgis-providers python3-gdal unzip xvfb xauth
# Debian's qgis_process is a wrapper that passes an option its program does not know.
qgis_process=$(command -v qgis_process.bin || command -v qgis_process)
export QT_QPA_PLATFORM=offscreen HOME=$work/home XDG_RUNTIME_DIR=$work PYTHONDONTWRITEBYTECODE=1 PYTHONWARNINGS=ignore
export PATH=$build:$PATH
chmod 700 "$work"
profile=$HOME/.local/share/QGIS/QGIS3/profiles/default

# Checks the zip.
make -s -C "$root" qgis QGIS_ZIP="$work/a.zip"
(umask 077 && sleep 2 && make -s -C "$root" qgis QGIS_ZIP="$work/b.zip")
cmp "$work/a.zip" "$work/b.zip" || fail "the zip is not the same twice"
passed "make qgis makes the same zip twice"
mkdir -p "$profile/python/plugins"
unzip -q "$work/a.zip" -d "$profile/python/plugins"
"$qgis_process" plugins enable meshmark_qgis >"$work/log" 2>&1 || fail "the plugin cannot be enabled: $(cat "$work/log")"
"$qgis_process" list >"$work/log" 2>&1
for algorithm in export verify compare; do
    grep -q "meshmark:$algorithm" "$work/log" || fail "qgis_process does not list meshmark:$algorithm"
done
passed "qgis_process lists the three algorithms"
"$qgis_process" help meshmark:export >"$work/log" 2>&1
grep -q 'Displacement of the vertices by a fingerprint' "$work/log" || fail "the help of AMPLITUDE is not that of the driver"

# run ALGORITHM NAME=VALUE...: leaves the exit code in $code.
run() {
    code=0
    "$qgis_process" run "meshmark:$1" -- "${@:2}" >"$work/log" 2>&1 || code=$?
}

logged() {
    grep -qF -- "$2" "$work/log" || fail "$1: \"$2\" is not in the log: $(cat "$work/log")"
}

# Tests names as users give them.
maps="$PWD/Karten für ACME"
mkdir "$maps" "$maps/records"
cp "$fixture" "$maps/map.gpkg"
marked="$maps/Straßen & Häuser.gpkg" base="$maps/records/Straßen & Häuser"
two_layers=("LAYERS=$maps/map.gpkg|layername=buildings" "LAYERS=$maps/map.gpkg|layername=roads")
export_two=("${two_layers[@]}" KEY="$PWD/key.json" RECORDS="$maps/records")
acme=(RECIPIENT="ACME GmbH")
run export "${export_two[@]}" "${acme[@]}" OUTPUT="$marked"
logged "export" "$base.json"
verify "the plugin's export" "$base.reference.gpkg" "$marked" --record "$base.json"
[ "$(ogrinfo -q "$marked" | cut -d' ' -f2 | tr '\n' ' ')" = "buildings roads " ] || fail "the layers are not those exported"
cp "$marked" suspect.gpkg
run export "${export_two[@]}" OUTPUT="$marked" RECIPIENT="Another Ltd" OVERWRITE=1
logged "a copy that is replaced" "$base-2.json"
verify "a copy that is replaced" "$base.reference.gpkg" "$marked" --record "$base-2.json"

run verify REFERENCE="$base.reference.gpkg" SUSPECT="$marked" KEY="$PWD/key.json" RECORDS="$maps/records" \
    EVIDENCE_MAP="$maps/evidence.gpkg"
logged "verify" "RECIPIENT:	Another Ltd"
logged "verify" "VERDICT:	match"
has_layers() {
    [ "$(ogrinfo -q "$1" | cut -d' ' -f2 | tr '\n' ' ')" = "$2 patches " ] || fail "$1 has not its two layers"
}
has_layers "$maps/evidence.gpkg" matched_vertices
run verify REFERENCE="$base.reference.gpkg" SUSPECT="$marked" KEY="$PWD/key.json" RECORDS="$maps/records" \
    EVIDENCE_MAP="$maps/exact.gpkg" EXACT_DISPLACEMENTS=1
logged "verify with exact displacements" "as secret as the records"
has_layers "$maps/exact.gpkg" vertex_displacements
run verify REFERENCE="$base.reference.gpkg" SUSPECT="$maps/map.gpkg" KEY="$PWD/key.json" RECORD="$base.json"
logged "verify, an unmarked map" "VERDICT:	no-match"
passed "verify names the recipient, and none for an unmarked map"
run compare ORIGINAL="$base.reference.gpkg" MARKED="$marked"
logged "compare" "NEWLY_INVALID:	0"
grep -q 'DISPLACEMENT_RMS_M:	0\.[01]' "$work/log" || fail "compare: the displacement is not that of a mark: $(cat "$work/log")"
passed "compare gives its figures"

# Runs the commands of docs/qgis.md except for the first, which is above.
mkdir example example/records
cp "$fixture" example/map.gpkg
mv suspect.gpkg example/
cp key.json example/
sed -n '/^```sh$/,/^```$/{//!p}' "$root/docs/qgis.md" | sed "/plugins enable/d; s|^qgis_process.bin|'$qgis_process'|" >"$work/example.sh"
(cd example && bash -e "$work/example.sh") >"$work/log" 2>&1 || fail "the commands of docs/qgis.md fail: $(cat "$work/log")"
logged "the commands of docs/qgis.md" "RECIPIENT:	ACME GmbH"
verify "the commands of docs/qgis.md" example/records/acme.reference.gpkg example/acme.gpkg --record example/records/acme.json

# A failure names its reason and leaves everything as it was.
(cd "$maps" && find . -type f -exec sha256sum {} + | sort -k2) >"$work/before"
refused() {
    logged "$1" "$2"
    [ "$code" -ne 0 ] || fail "$1: qgis_process ends with exit code 0"
    ! grep -q '^RECORD:' <(sed -n '/^Results/,$p' "$work/log") || fail "$1: a record is named"
    (cd "$maps" && find . -type f -exec sha256sum {} + | sort -k2) >"$work/after"
    diff "$work/before" "$work/after" || fail "$1: files were changed or left"
    passed "$1: everything is as it was"
}
run export "${export_two[@]}" "${acme[@]}" OUTPUT="$marked"
refused "export, the file exists" "exists: choose another file, or let it be replaced (OVERWRITE)"
run export "${two_layers[@]}" "${acme[@]}" OUTPUT="$maps/new.gpkg" KEY="$PWD/wrong.json" RECORDS="$maps/records"
refused "export, a wrong key file" "wrong.json is not usable"
run export "${export_two[@]}" "${acme[@]}" OUTPUT="$maps/new.shp"
refused "export, two layers to a Shapefile" "Shapefile"
run export "${two_layers[@]}" "${acme[@]}" OUTPUT="$maps/new.gpkg" KEY="$PWD/key.json" RECORDS="$maps/none"
refused "export, no record folder" "none does not exist: make it, or choose another"
run export "${export_two[@]}" "${acme[@]}" OUTPUT="$maps/new.gpkg" MESSAGE=0011
refused "export, recipient and message" "but not both"
run export "${export_two[@]}" OUTPUT="$maps/new.gpkg"
refused "export, no recipient" "No recipient is given"
run export "${export_two[@]}" "${acme[@]}" OUTPUT=TEMPORARY_OUTPUT
refused "export, a temporary file" "No file to hand out is named"
run export "${export_two[@]}" RECIPIENT=B OUTPUT="$marked" OVERWRITE=1 PATCH_SIZE=4096
refused "export, a failure with an older file in the place" "is the older file, not a copy of this run"
run export "${export_two[@]}" "${acme[@]}" OUTPUT="$maps/new.gpkg" PATCH_SIZE=4096
refused "export, a map that is too small" "vertices"
run verify REFERENCE="$base.reference.gpkg" SUSPECT="$marked" KEY="$PWD/wrong.json" RECORD="$base.json" \
    EVIDENCE_MAP="$maps/new.gpkg"
refused "verify, a wrong key file" "wrong.json"
run verify REFERENCE="$base.reference.gpkg" SUSPECT="$marked" KEY="$PWD/key.json" RECORD="$base.json" \
    EVIDENCE_MAP="$maps/evidence.gpkg"
refused "verify, the evidence map exists" "exists: name another file"
run compare ORIGINAL="$root/fixtures/helsinki.gpkg" MARKED="$marked"
refused "compare, another map" "compare a map with the copy that was marked from it"
mkdir "$work/none"
GDAL_DRIVER_PATH=$work/none run export "${export_two[@]}" "${acme[@]}" OUTPUT="$maps/new.gpkg"
refused "export, the driver is missing" "The GDAL driver MESHMARK is not installed"
PATH=${PATH#"$build:"} run verify REFERENCE="$base.reference.gpkg" SUSPECT="$marked" KEY="$PWD/key.json" RECORD="$base.json"
refused "verify, the command is missing" "The command meshmark is not installed"

# If the settings name driver and command, these may be anywhere.
mkdir -p "$profile/QGIS"
cp "$profile/QGIS/QGIS3.ini" "$work/QGIS3.ini" 2>/dev/null || touch "$work/QGIS3.ini"
printf '\n[meshmark]\ndriver_folder=%s\ncommand=%s\n' "$build/gdalplugins" "$meshmark" >>"$profile/QGIS/QGIS3.ini"
(
    export GDAL_DRIVER_PATH=$work/none PATH=${PATH#"$build:"}
    run export "${export_two[@]}" "${acme[@]}" OUTPUT="$PWD/by_settings.gpkg"
    run verify REFERENCE="$maps/records/by_settings.reference.gpkg" SUSPECT="$PWD/by_settings.gpkg" KEY="$PWD/key.json" \
        RECORD="$maps/records/by_settings.json"
    logged "the settings" "VERDICT:	match"
)
passed "driver and command are found by the settings"
cp "$work/QGIS3.ini" "$profile/QGIS/QGIS3.ini"

cp "$root/fixtures/europe_deg.gpkg" europe.gpkg
cp "$fixture" map.gpkg
"${python[@]}" "$hosts/in_qgis_plugin.py" "$profile/python/plugins" 2>"$work/log" || fail "$(cat "$work/log")"
! grep -q Traceback "$work/log" || fail "the user sees a traceback: $(cat "$work/log")"
for copy in memory filtered degrees joined; do
    verify "a copy of layers, $copy" "records/$copy.reference.gpkg" "$copy.gpkg" --record "records/$copy.json"
done

timeout 300 "${python[@]}" "$hosts/in_qgis_dialogs.py" "$profile/python/plugins" 2>"$work/log" || fail "$(cat "$work/log")"

# Runs in QGIS itself.
mkdir "$work/desktop" "$work/desktop/records" "$work/pictures"
cp "$fixture" "$work/desktop/map.gpkg"
cp key.json "$work/desktop/"
export MESHMARK_WORK=$work/desktop MESHMARK_PICTURES=${PICTURES:-$work/pictures}
QT_QPA_PLATFORM=xcb timeout 300 xvfb-run -a -s "-screen 0 1280x960x24" \
    qgis --nologo --noversioncheck --code "$hosts/in_qgis_desktop.py" >"$work/log" 2>&1 || fail "QGIS: $(cat "$work/log")"
verify "the context menu's export" "$work/desktop/records/by_menu.reference.gpkg" "$work/desktop/by_menu.gpkg" \
    --record "$work/desktop/records/by_menu.json"
passed "QGIS shows dialog, vertices and patches"
