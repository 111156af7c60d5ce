#!/usr/bin/env bash
# Builds the wheel for Linux on x86-64 and AArch64 and for Windows, and uses it in clean Debians with the
# oldest Python that it supports and that of the newest Debian. Installs debootstrap and MinGW-w64 where
# they are missing, and needs root, or sudo.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"
source "$hosts/clean_debian.sh"

most_bytes=8000000
oldest=bullseye newest=trixie # Python 3.9 and 3.13

install_missing debootstrap gcc-mingw-w64-x86-64 python3-venv
out=$root/target/python
rm -rf "$out/wheels"
for target in {x86_64,aarch64}-unknown-linux-gnu x86_64-pc-windows-gnu; do
    rustup target list --installed | grep -q "^$target$" || rustup --quiet target add "$target" ||
        fail "Rust's library for $target is missing: rustup target add $target"
    "$root/python/build_wheel.sh" python3 "$out" "$target" >"$work/log" 2>&1 || fail "$target: $(tail -n 30 "$work/log")"
done
for wheel in "$out"/wheels/*.whl; do
    bytes=$(stat -c %s "$wheel")
    [ "$bytes" -le $most_bytes ] || fail "$(basename "$wheel") has $bytes bytes"
    passed "$(basename "$wheel"): $bytes bytes"
done

# Python finds what the library needs, or Windows has it.
unzip -q -o "$out"/wheels/*win_amd64.whl '*.pyd' -d "$work/windows"
imports=$(x86_64-w64-mingw32-objdump -p "$work"/windows/meshmark/*.pyd | sed -n 's/.*DLL Name: //p')
foreign=$(grep -viE '^(python3|kernel32|ntdll|msvcrt|bcrypt(primitives)?|advapi32|userenv|ws2_32|api-ms-win-.*)\.dll$' <<<"$imports" || true)
[ -z "$foreign" ] || fail "the library for Windows needs what a user may lack: $foreign"
passed "the library for Windows needs" $imports

for suite in $oldest $newest; do
    new_root "$suite" "$work/$suite"
    "${as_root[@]}" cp "$out"/wheels/*manylinux*x86_64.whl "$root/python/run_examples.py" "$work/$suite/root/"
    in_root "$work/$suite" "Debian $suite" "apt-get update -q && apt-get install -y -q --no-install-recommends python3-venv ca-certificates &&
        python3 -m venv clean && PIP_CERT=/opt/certs/ca-certificates.crt clean/bin/pip install -q *.whl geopandas &&
        clean/bin/python run_examples.py"
    passed "Debian $suite: $(tail -n 1 "$work/log")"
done
