#!/bin/bash
# Makes docs/validation.md from all studies of errors: studies/validation.sh TOOLS OUT MAP...
# TOOLS is the folder of the studies, of meshmark and of gdalplugins/. The sizes can be set: COUNT (wrong
# keys and recipients for each suspect), MISSES and COPIES (damaged copies of each map), OTHERS
# (recipients for each copy), KEYS, SIZES (of coalitions), SEED. A study whose table is in OUT already is
# not run again.
set -euo pipefail
tools=$1 out=$2
shift 2
seed=${SEED:-2003}
mkdir -p "$out"

run() { # NAME ARGUMENTS...
    [ -e "$out/$1/$1.md" ] || "$tools/$1" --out "$out/$1.part" --seed "$seed" "${@:2}" >&2
    [ ! -e "$out/$1.part" ] || mv "$out/$1.part" "$out/$1"
}

run false_alarms --count "${COUNT:-200}" "$@"
run misses --count "${MISSES:-120}" "$@"
run calibration --copies "${COPIES:-40}" --others "${OTHERS:-9000}" --keys "${KEYS:-2000}" "$@"
run coalitions --sizes "${SIZES:-2,4,8,16,32}" "$@"

table() { # NAME: its table without the title of a document
    sed "s/^Seed [0-9]*, /Maps: /; s/^Seed [0-9]*\\. //" "$out/$1/$1.md"
}

cat > "$out/validation.md" <<END
# Validation

\`make validation\` makes this page from the studies of errors. All random numbers follow from the seed
$seed, so that the same maps and the same version give the same tables. Made with
$("$tools/meshmark" --version) on

| map | SHA-256 |
|---|---|
$(for map in "$@"; do echo "| $(basename "$map") | $(sha256sum "$map" | cut -d ' ' -f 1) |"; done)

The sizes below fit the time that was there: \`COUNT\`, \`MISSES\`, \`COPIES\`, \`OTHERS\`, \`KEYS\` and
\`SIZES\` set others, and \`MAPS\` other maps. [Evaluation](evaluation.md) and [security](security.md) have
larger runs of single studies.

## Is somebody innocent named?

Keys and recipients that have no part in a suspect, on copies that were marked and attacked, and on maps
without a mark: messages.

$(table false_alarms)

## Is somebody guilty excluded?

Copies that carry the mark of a message, damaged in random ways; *no match* would be wrong.

$(table misses)

## Are likelihood ratios right?

Fingerprints in copies that were damaged in random ways.

$(table calibration)

## Who is named when copies are mixed?

$(table coalitions)
END
echo "written to $out/validation.md"
