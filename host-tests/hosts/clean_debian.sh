# Sourced by scripts that need a clean Debian; they have `fail` and a folder $work, in which the
# roots are made. Needs root, or sudo.
as_root=()
[ "$(id -u)" -eq 0 ] || as_root=(sudo)
trap '"${as_root[@]}" rm -rf "$work"' EXIT

# new_root SUITE FOLDER: makes a Debian with apt alone.
new_root() {
    local mirror
    mirror=$(apt-get indextargets --format '$(SITE)' 'Codename: bookworm' 'Created-By: Packages' 2>/dev/null |
        grep -v security | head -n 1) || true
    "${as_root[@]}" debootstrap --variant=minbase "$1" "$2" ${mirror:+"$mirror"} >"$work/log" 2>&1 ||
        fail "debootstrap: $(tail -n 5 "$work/log")"
}

# in_root FOLDER WHAT COMMAND: runs COMMAND there, in /root, with the certificates of this machine.
# The folders of the array `mounts`, "FROM TO", are mounted only while it runs, so that the removal
# of a root never reaches them. Sets `seconds` to the duration.
mounts=()
in_root() {
    local folder=$1 what=$2 command=$3 mount from to begin=$EPOCHREALTIME
    local mount_all="mount -t proc proc '$folder/proc' && mount -t tmpfs tmpfs '$folder/dev/shm'"
    mount_all+=" && mount -t devpts devpts '$folder/dev/pts'"
    for mount in "${mounts[@]}" "/etc/ssl/certs /opt/certs"; do
        read -r from to <<<"$mount"
        mount_all+=" && mkdir -p '$folder$to' && mount --bind '$from' '$folder$to'"
    done
    "${as_root[@]}" unshare --mount bash -c "$mount_all && exec chroot '$folder' /usr/bin/env -i HOME=/root \
        PATH=/opt/rust/bin:/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
        CARGO_HTTP_CAINFO=/opt/certs/ca-certificates.crt bash -ec \"\$1\"" \
        bash "cd && $command" >"$work/log" 2>&1 || fail "$what: $(tail -n 100 "$work/log")"
    seconds=$(awk "BEGIN { printf \"%.0f\", $EPOCHREALTIME - $begin }")
}
