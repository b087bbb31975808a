#!/bin/sh
# wheelhouse.sh FOLDER: combtrace and all that it needs, as files to carry to a machine without a network.
# Run it where there is one, on the same kind of machine (processor, Debian release, Python) as the other.
set -eu
folder=${1:?which folder?}
here=$(cd "$(dirname "$0")/.." && pwd)
python=${PYTHON:-python3}

mkdir -p "$folder"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$python" -m venv "$work/venv"
pip="$work/venv/bin/python -m pip --disable-pip-version-check --quiet"
# Sources are copied: a build leaves its traces beside them.
(cd "$here" && tar -cf - pyproject.toml README.md LICENSE contour drivers service) | (mkdir "$work/sources" && cd "$work/sources" && tar -xf -)
$pip wheel --no-deps --wheel-dir "$folder" "$work/sources"
wheel=$(ls -t "$folder"/combtrace-*.whl | head -n 1)
$pip download --only-binary :all: --constraint "$here/constraints.txt" --dest "$folder" "${wheel}[metrics,page,export,hil]"
cp "$here/constraints.txt" "$folder/"
cat > "$folder/install.sh" <<'INSTALL'
#!/bin/sh
# install.sh [FOLDER]: install combtrace from the files beside this script, without a network; default /opt/combtrace
set -eu
here=$(cd "$(dirname "$0")" && pwd)
target=${1:-/opt/combtrace}
python=${PYTHON:-python3}
"$python" -m venv "$target"
"$target/bin/python" -m pip --disable-pip-version-check --quiet install --no-index --find-links "$here" \
    --constraint "$here/constraints.txt" 'combtrace[metrics,page,export,hil]'
"$target/bin/combtrace" --version
INSTALL
chmod +x "$folder/install.sh"
echo "$(ls "$folder"/*.whl | wc -l) wheels, $(du -sh "$folder" | cut -f1), in $folder; there: sh install.sh"
