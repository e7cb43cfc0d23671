#!/bin/sh
# Virtual CAN interfaces: `vcan.sh [--down] [NAME...]`, by default vcan0 and vcan1. May be run again at any time.
# Exit: 0 done, 1 refused by the system, 2 usage, 3 this kernel has no vcan, 4 not permitted, 5 no `ip` command.
set -u
PATH="$PATH:/usr/sbin:/sbin"

say() { echo "vcan.sh: $*" >&2; }

usage() {
    echo "usage: vcan.sh [--down] [NAME...]" >&2
    echo "Brings up virtual CAN interfaces (vcan0 and vcan1), or with --down removes them." >&2
    exit "$1"
}

is_vcan() { ip -details link show dev "$1" 2>/dev/null | grep -qw vcan; }
exists() { ip link show dev "$1" >/dev/null 2>&1; }
is_up() { ip link show dev "$1" up 2>/dev/null | grep -q .; }

require_permission() {
    # CAP_NET_ADMIN is bit 12 of the effective set.
    effective=$(sed -n 's/^CapEff:[[:space:]]*//p' /proc/self/status)
    [ $((0x$effective >> 12 & 1)) = 1 ] && return
    say "not permitted: making interfaces needs CAP_NET_ADMIN; try: sudo $0"
    exit 4
}

# The answer of the kernel itself: built in, a module already there, or one that modprobe finds.
require_vcan() {
    ip link add dev axisyncprobe type vcan 2>/dev/null || {
        modprobe -q vcan 2>/dev/null
        ip link add dev axisyncprobe type vcan 2>/dev/null
    } || {
        say "this kernel ($(uname -r)) has no vcan: use simcan, or deploy/uml/run.py for a kernel that has it"
        exit 3
    }
    ip link delete dev axisyncprobe
}

bring_up() {
    if exists "$1"; then
        is_vcan "$1" || { say "$1 is there already and is no vcan interface: left alone"; exit 1; }
    else
        require_vcan
        ip link add dev "$1" type vcan || exit 1
    fi
    is_up "$1" || ip link set dev "$1" up || exit 1
    echo "$1 up"
}

take_down() {
    exists "$1" || return 0
    is_vcan "$1" || { say "$1 is no vcan interface: left alone"; exit 1; }
    ip link delete dev "$1" || exit 1
    echo "$1 removed"
}

action=bring_up
while [ $# -gt 0 ]; do
    case "$1" in
        --down) action=take_down ;;
        -h | --help) usage 0 ;;
        -*) usage 2 ;;
        *) break ;;
    esac
    shift
done
[ $# -gt 0 ] || set -- vcan0 vcan1

command -v ip >/dev/null || { say "there is no ip command (Debian: apt install iproute2)"; exit 5; }
for name in "$@"; do
    if [ "$action" = bring_up ] && exists "$name" && is_vcan "$name" && is_up "$name"; then
        echo "$name up"
        continue
    fi
    [ "$action" = take_down ] && ! exists "$name" && continue
    require_permission
    "$action" "$name"
done
