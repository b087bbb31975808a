#!/bin/sh
# reproduce.sh FOLDER: build wheel, source distribution and packages twice, the second time as elsewhere and later; both
# must be the same, bit for bit, or diffoscope says what is not. They are put into FOLDER.
set -eu
folder=$(mkdir -p "${1:?which folder?}" && cd "$1" && pwd)
here=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
. "$here/packaging/common.sh"
# What comes through the network comes before, while the clock is right.
PYTHON=/usr/bin/python3
tools
mkdir "$work/wheels"
dependencies "$work/wheels"
export WHEELS="$work/wheels"
sources "$work/tree"
# User, host name and kernel stay as they are: to vary them takes more than a container has. So does the order of
# files in folders (FUSE).
reprotest --store-dir "$work/out" --variations=+all,-user_group,-domain_host,-kernel,-fileordering \
    -c 'sh packaging/deb.sh out' "$work/tree" 'out/*' -- null > "$work/log" 2>&1 || { tail -n 60 "$work/log" >&2; exit 1; }
cp "$work"/out/control/source-root/out/* "$folder/"
