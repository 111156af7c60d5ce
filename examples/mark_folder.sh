#!/usr/bin/env bash
# Marks every sheet of a folder for one recipient: mark_folder.sh SHEETS KEY RECIPIENT FOLDER
# A sheet that was marked before is left as it is, so that the script can be run again after a
# failure. References, which are the unmarked sheets, and records go into the folder as well: hand
# out the copies alone.
set -euo pipefail
sheets=$1 key=$2 recipient=$3 folder=$4

mkdir -p "$folder"
[ ! "$sheets" -ef "$folder" ] || { echo "$folder holds the sheets themselves: name another folder" >&2; exit 1; }
failed=0
for sheet in "$sheets"/*.gpkg; do
    name=$(basename "$sheet" .gpkg)
    [ -e "$folder/$name.gpkg" ] && continue
    # Written as the last step: the file appears complete and verified, or not at all.
    ogr2ogr -f MESHMARK "MESHMARK:$folder/$name.gpkg" "$sheet" -dsco KEY="$key" -dsco RECIPIENT="$recipient" \
        -dsco REFERENCE="$folder/$name.reference.gpkg" -dsco RECORD="$folder/$name.json" || failed=$((failed + 1))
done
[ "$failed" -eq 0 ] || { echo "sheets that were not marked: $failed" >&2; exit 1; }
