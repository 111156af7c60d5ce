#!/usr/bin/env bash
# Marks every sheet of a folder for one recipient, so that the copies fit together:
# mark_folder.sh SHEETS KEY RECIPIENT COPIES PRIVATE
# The copies go to COPIES, to be handed out, and the plan, the references, which are the unmarked sheets,
# and the records to PRIVATE. A sheet that was marked before is left as it is, so that the script can be
# run again after a failure. When a sheet has changed, name new folders: the plan changes with it.
set -euo pipefail
sheets=$1 key=$2 recipient=$3 copies=$4 private=$5

mkdir -p "$copies"
mkdir -p -m 700 "$private"
[ ! "$copies" -ef "$private" ] || { echo "$copies would hold the references, too: name two folders" >&2; exit 1; }
for folder in "$copies" "$private"; do
    [ ! "$sheets" -ef "$folder" ] || { echo "$folder holds the sheets themselves: name another folder" >&2; exit 1; }
done
plan=$private/plan.json
[ -e "$plan" ] || meshmark plan "$sheets"/*.gpkg -o "$plan"
failed=0
for sheet in "$sheets"/*.gpkg; do
    name=$(basename "$sheet" .gpkg)
    [ -e "$copies/$name.gpkg" ] && continue
    # Written as the last step: the file appears complete and verified, or not at all.
    ogr2ogr -f MESHMARK "MESHMARK:$copies/$name.gpkg" "$sheet" -dsco KEY="$key" -dsco RECIPIENT="$recipient" \
        -dsco SHEETS="$plan" -dsco REFERENCE="$private/$name.gpkg" -dsco RECORD="$private/$name.json" || failed=$((failed + 1))
done
[ "$failed" -eq 0 ] || { echo "sheets that were not marked: $failed" >&2; exit 1; }
