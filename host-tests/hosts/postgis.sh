#!/usr/bin/env bash
# Marks a table of a real PostGIS by reading, and checks that none is written to. Installs
# PostgreSQL and PostGIS where they are missing; the server is a new one, in a temporary folder,
# reached by its socket alone.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

# PostgreSQL does not run as root.
as_owner() {
    if [ "$(id -u)" -eq 0 ]; then
        setpriv --reuid postgres --regid postgres --clear-groups "$@"
    else
        "$@"
    fi
}

start_server() {
    programs=$(dirname "$(find /usr/lib/postgresql -path '*/bin/initdb' | sort -V | tail -1)")
    server=$(mktemp -d -t meshmark.XXXXXX)
    [ "$(id -u)" -ne 0 ] || chown postgres: "$server"
    (
        cd "$server"
        as_owner "$programs/initdb" -D "$server/data" -U meshmark -A trust --no-sync -E UTF8 >"$work/initdb.log"
        as_owner "$programs/pg_ctl" -D "$server/data" -l "$server/log" -w start \
            -o "-c listen_addresses='' -c unix_socket_directories='$server' -c fsync=off" >"$work/start.log"
    ) || fail "the server does not start: $(cat "$work"/*.log "$server/log" 2>/dev/null)"
    connection="host=$server user=meshmark dbname=map"
    "$programs/createdb" -h "$server" -U meshmark map
    "$programs/psql" -q -h "$server" -U meshmark map -c 'CREATE EXTENSION postgis' >/dev/null
}

stop_server() {
    local status=$?
    [ ! -d "${server:-/nowhere}/data" ] ||
        (cd / && as_owner "$programs/pg_ctl" -D "$server/data" -m fast stop >/dev/null) || true
    rm -rf "${server:-}" "$work"
    exit $status
}

tables() {
    "$programs/psql" -q -A -t -h "$server" -U meshmark map -c \
        "SELECT count(*) FROM information_schema.tables WHERE table_schema = 'public'"
}

packages=(gdal-bin postgresql)
# The package of PostGIS is named after the version of PostgreSQL.
[ -n "$(find /usr/share/postgresql -name postgis.control 2>/dev/null)" ] || packages+=(postgresql-postgis)
install_missing "${packages[@]}"
trap stop_server EXIT
start_server
ogr2ogr -f PostgreSQL "PG:$connection" "$fixture"
before=$(tables)

key=(-oo KEY=key.json -oo RECIPIENT="ACME GmbH")
ogr2ogr -f GPKG marked.gpkg "MESHMARK:PG:$connection" "${key[@]}" -oo RECORD=acme.json
ogr2ogr -f GPKG reference.gpkg "PG:$connection"
verify "a copy in a file" reference.gpkg marked.gpkg --record acme.json
verify "the database as the reference" "PG:$connection" marked.gpkg --record acme.json

# Marks one table into the database, in which PostgreSQL's own driver writes the copy.
rm acme.json
ogr2ogr -f PostgreSQL "PG:$connection" "MESHMARK:PG:$connection tables=buildings" "${key[@]}" -oo RECORD=acme.json \
    -nln marked
ogr2ogr -f GPKG from_database.gpkg "PG:$connection tables=marked" # a suspect is a file
verify "a copy in the database" "PG:$connection tables=buildings" from_database.gpkg --record acme.json
[ "$(tables)" -eq $((before + 1)) ] || fail "one table is made, not $(tables) - $before"

# No table is a target of marking as the last step.
before=$(tables)
if ogr2ogr -f MESHMARK "MESHMARK:PG:$connection" "$fixture" buildings -dsco KEY=key.json -dsco RECIPIENT=B \
    -dsco REFERENCE=second.gpkg -dsco FORMAT=PostgreSQL 2>"$work/log"; then
    fail "writing to a database is not refused"
fi
grep -q 'FORMAT=PostgreSQL is not a format that a marked map is written to' "$work/log" ||
    fail "the refusal does not say why: $(cat "$work/log")"
[ "$(tables)" -eq "$before" ] && [ ! -e second.gpkg ] || fail "a refused target was written to"
passed "PostgreSQL is refused as a target"

printf 'ACME GmbH\nBeta Oy' >recipients.txt
"$root/examples/postgis_recipients.sh" "$connection" buildings key.json recipients.txt copies >"$work/log" 2>&1 ||
    fail "postgis_recipients.sh: $(cat "$work/log")"
for number in 1 2; do
    verify "postgis_recipients.sh" copies/reference.gpkg "copies/copy_$number.gpkg" --record "copies/copy_$number.json"
done
