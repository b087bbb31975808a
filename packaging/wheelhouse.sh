#!/bin/sh
# wheelhouse.sh FOLDER: combtrace and all that it needs, as files to carry to a machine without a network.
# Run it where there is one, on the same kind of machine (processor, Debian release, Python) as the other.
# A file whose hash is not in requirements.txt is refused, here and there.
set -eu
folder=${1:?which folder?}
here=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
. "$here/packaging/common.sh"
mkdir -p "$folder"
tools
dependencies "$folder"
ours "$folder"
rm "$folder/combtrace-$version.tar.gz"
cp "$here/packaging/requirements.txt" "$folder/"
hash=$(sha256sum "$folder/combtrace-$version-py3-none-any.whl" | cut -d ' ' -f 1)
echo "combtrace==$version --hash=sha256:$hash" >> "$folder/requirements.txt"
cat > "$folder/install.sh" <<'INSTALL'
#!/bin/sh
# install.sh [FOLDER]: install combtrace from the files beside this script, without a network; default /opt/combtrace
set -eu
here=$(cd "$(dirname "$0")" && pwd)
target=${1:-/opt/combtrace}
python=${PYTHON:-python3}
"$python" -m venv "$target"
"$target/bin/python" -m pip --disable-pip-version-check --quiet install --no-index --find-links "$here" \
    --require-hashes --requirement "$here/requirements.txt"
"$target/bin/combtrace" --version
INSTALL
chmod +x "$folder/install.sh"
echo "$(ls "$folder"/*.whl | wc -l) wheels, $(du -sh "$folder" | cut -f1), in $folder; there: sh install.sh"
