#!/bin/bash
# Makes docs/validation.md from the studies of errors: studies/validation.sh TOOLS OUT MAP...
# TOOLS is the folder of the studies, of meshmark and of gdalplugins/. These can be set: STUDIES (which of
# them), COUNT (wrong keys and recipients for each suspect), MISSES and COPIES (damaged copies of each
# map), OTHERS (recipients for each copy), KEYS, SIZES (of coalitions), SEED. A study whose table is in
# OUT already is not run again.
set -euo pipefail
tools=$1 out=$2
shift 2
seed=${SEED:-2003} studies=${STUDIES:-false_alarms misses calibration coalitions}
mkdir -p "$out"

declare -A size=(
    [false_alarms]="--count ${COUNT:-200}"
    [misses]="--count ${MISSES:-120}"
    [calibration]="--copies ${COPIES:-40} --others ${OTHERS:-9000} --keys ${KEYS:-2000}"
    [coalitions]="--sizes ${SIZES:-2,4,8,16,32}"
)
declare -A question=(
    [false_alarms]="Is somebody innocent named?

Keys and recipients that have no part in a suspect, on copies that were marked and attacked, and on maps
without a mark: messages."
    [misses]="Is somebody guilty excluded?

Copies that carry the mark of a message, damaged in random ways; *no match* would be wrong."
    [calibration]="Are likelihood ratios right?

Fingerprints in copies that were damaged in random ways; a study of other recipients of the same key,
and of wrong keys on damaged maps without a mark."
    [coalitions]="Who is named when copies are mixed?"
)

for study in $studies; do
    if [ ! -e "$out/$study/$study.md" ]; then
        # shellcheck disable=SC2086 # the size is two or more words
        "$tools/$study" --out "$out/$study.part" --seed "$seed" ${size[$study]} "$@" >&2
        echo "${size[$study]} $(basename -a "$@" | paste -sd ' ')" >"$out/$study.part/arguments"
        mv "$out/$study.part" "$out/$study"
    fi
done

{
    cat <<END
# Validation

\`make validation\` makes this page from the studies of errors. All random numbers follow from the seed
$seed, so that the same maps and the same version give the same tables. Made with
$("$tools/meshmark" --version) on these maps, of which [evaluation.md](evaluation.md#protocol) names the sources:

| map | SHA-256 |
|---|---|
$(for map in "$@"; do echo "| $(basename "$map") | $(sha256sum "$map" | cut -d ' ' -f 1) |"; done)

The command of each study is given, with its size; these are small. \`MAPS\`,
\`STUDIES\` and the sizes in \`studies/validation.sh\` choose others. [Evaluation](evaluation.md) has larger
runs of the studies of [false alarms](evaluation.md#false-alarms) and [misses](evaluation.md#misses), and
[security](security.md) those of coalitions.
END
    for study in $studies; do
        printf '\n## %s\n\n`%s --seed %s %s`: ' "${question[$study]}" "$study" "$seed" "$(<"$out/$study/arguments")"
        cat "$out/$study/$study.md"
    done
} >"$out/validation.md"
echo "written to $out/validation.md"
