#!/bin/sh
# deb.sh FOLDER: wheel, source distribution, and the Debian packages for this machine's processor and its Debian's
# Python, put into FOLDER. TOOLS and WHEELS (common.sh) given, no network is needed.
set -eu
folder=$(mkdir -p "${1:?which folder?}" && cd "$1" && pwd)
here=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
. "$here/packaging/common.sh"
PYTHON=/usr/bin/python3
tools
tree="$work/combtrace"
sources "$tree"
mkdir "$tree/wheelhouse"
dependencies "$tree/wheelhouse"
ours "$folder"
cp "$folder"/combtrace-"$version"-*.whl "$tree/wheelhouse/"

mv "$tree/packaging/debian" "$tree/debian"
cp "$tree/packaging/systemd/combtrace.service" "$tree/debian/"
cp "$tree/packaging/udev/70-combtrace.rules" "$tree/debian/combtrace.udev"
cat > "$tree/debian/changelog" <<CHANGELOG
combtrace ($version) stable; urgency=medium

  * CHANGELOG.md, in the package's documents, says what is new.

 -- combtrace maintainers <maintainers@combtrace.invalid>  $(LC_ALL=C date --utc --rfc-email --date="@$SOURCE_DATE_EPOCH")
CHANGELOG
cd "$tree"
dpkg-buildpackage --build=binary --no-sign > "$work/log" 2>&1 || { tail -n 60 "$work/log" >&2; exit 1; }
cp "$work"/combtrace*.deb "$folder/"
ls "$folder"/combtrace*_"$version"_*.deb
