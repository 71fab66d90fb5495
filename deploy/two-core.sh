#!/bin/sh
# Runs a command on at most two cores, and says how they are limited.
#
#   deploy/two-core.sh COMMAND [ARGUMENT...]
#
# cgroup v2 (root, cpu controller on): a bandwidth of two cores for everything started through this
# script, together. Otherwise CPU affinity: the first two cores this process may use.
set -eu

if [ $# -eq 0 ]; then
    echo "usage: $0 COMMAND [ARGUMENT...]" >&2
    exit 2
fi

say() { echo "two-core: $*" >&2; }

cgroup=/sys/fs/cgroup
group=$cgroup/hybridnav-two-core

enter_group() {
    grep -qsw cpu "$cgroup/cgroup.subtree_control" || return 1
    mkdir -p "$group" 2>/dev/null || return 1
    # 200 ms of processor time in every 100 ms.
    { echo "200000 100000" >"$group/cpu.max"; } 2>/dev/null || return 1
    { echo $$ >"$group/cgroup.procs"; } 2>/dev/null || return 1
}

if enter_group; then
    say "cgroup v2, cpu.max = $(cat "$group/cpu.max") in $group"
    exec "$@"
fi

if ! command -v taskset >/dev/null; then
    say "cgroup v2 is not writable and taskset is not installed (on Debian: apt-get install util-linux)"
    exit 1
fi

# "0-3,8" becomes the first two of 0 1 2 3 8.
allowed=$(sed -n 's/^Cpus_allowed_list:[[:space:]]*//p' /proc/self/status)
cores=$(echo "$allowed" | tr ',' '\n' | while IFS=- read -r first last; do
    seq "$first" "${last:-$first}"
done | head -n 2 | paste -sd, -)
say "CPU affinity, cores $cores (cgroup v2 with the cpu controller is not writable)"
exec taskset --cpu-list "$cores" "$@"
