#!/bin/sh
# release.sh FOLDER: all that a version is handed out as, put into FOLDER, if the tree is fit for it. Publishes nothing.
set -eu
folder=$(mkdir -p "${1:?which folder?}" && cd "$1" && pwd)
here=$(cd "$(dirname "$0")/.." && pwd)
. "$here/packaging/common.sh"
refuse() { echo "release: $*" >&2; exit 1; }

cd "$here"
[ -z "$(git status --porcelain)" ] || refuse "the tree has changes, expected none: commit or stash them"
head=$(grep -m 1 '^## ' CHANGELOG.md)
[ "$head" = "## $version ($day)" ] ||
    refuse "CHANGELOG.md begins with '$head', expected '## $version (YYYY-MM-DD)': move its entries below that"
git rev-parse --quiet --verify "refs/tags/v$version" > /dev/null && refuse "tag v$version is there already: raise version in pyproject.toml"
[ -z "$(find "$folder" -type f)" ] || refuse "$folder is not empty: empty it"

sh packaging/reproduce.sh "$folder"
for package in combtrace combtrace-extras; do
    dpkg-deb --fsys-tarfile "$folder/${package}_${version}"_*.deb |
        tar -xO "./usr/share/doc/$package/sbom.cdx.json" > "$folder/$package-$version.cdx.json"
done
(cd "$folder" && sha256sum -- * > SHA256SUMS && cat SHA256SUMS)
cat <<NEXT
built twice, the same. What is left:
  CI=true .ci/run
  git tag --annotate v$version --message "combtrace $version"
NEXT
