#!/usr/bin/env bash
# Marks a table of PostGIS once for every recipient:
# postgis_recipients.sh CONNECTION TABLE KEY LIST FOLDER
# LIST has one recipient per line. The reference, which is the unmarked table, and the records go
# into the folder as well: keep them, and hand out the copies alone.
set -euo pipefail
connection=$1 table=$2 key=$3 list=$4 folder=$5

mkdir -p "$folder"
ogr2ogr -f GPKG "$folder/reference.gpkg" "PG:$connection" "$table"
number=0
while IFS= read -r recipient || [ -n "$recipient" ]; do # the last line may have no end
    [ -n "$recipient" ] || continue
    number=$((number + 1))
    ogr2ogr -f GPKG "$folder/copy_$number.gpkg" "MESHMARK:$folder/reference.gpkg" \
        -oo KEY="$key" -oo RECIPIENT="$recipient" -oo RECORD="$folder/copy_$number.json"
    echo "copy_$number.gpkg: $recipient"
done <"$list"
