#!/usr/bin/env bash
# Writes verification/src/verify/projected_crs.csv from PROJ's database: which projected CRS are meant for which
# place.
# Usage: verification/make_projected_crs.sh [proj.db]; needs sqlite3.
set -euo pipefail

database=${1:-$(for folder in "${PROJ_DATA:-}" /usr/share/proj /usr/local/share/proj; do
    [ -f "$folder/proj.db" ] && echo "$folder/proj.db" && break
done)}
[ -f "$database" ] || { echo "there is no proj.db in PROJ_DATA or /usr/share/proj: name it" >&2; exit 1; }
out=$(dirname "$0")/src/verify/projected_crs.csv
version=$(sqlite3 "$database" "select value from metadata where key = 'EPSG.VERSION'")

{
    echo "# EPSG codes and areas of use (degrees west, south, east, north) from the EPSG dataset $version;"
    echo "# made by verification/make_projected_crs.sh, not to be edited."
    sqlite3 -separator , "$database" "
        select distinct crs.code, round(west_lon, 1), round(south_lat, 1), round(east_lon, 1), round(north_lat, 1)
        from projected_crs crs
        join usage on object_table_name = 'projected_crs' and object_auth_name = 'EPSG' and object_code = crs.code
        join extent on extent.auth_name = extent_auth_name and extent.code = extent_code
        where crs.auth_name = 'EPSG' and crs.deprecated = 0
        order by cast(crs.code as integer), 2, 3, 4, 5"
} > "$out"
echo "$(grep -vc '^#' "$out") lines in $out"
