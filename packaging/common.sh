# Read by the scripts here, which have the repository in $here and a folder of their own in $work.
umask 022
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' "$here/pyproject.toml")
# The day of the newest version in the changelog: all that is built says it was made then, so it is always the same.
day=$(sed -n 's/^## .* (\([0-9-]*\))$/\1/p' "$here/CHANGELOG.md" | head -n 1)
SOURCE_DATE_EPOCH=$(date --utc --date="$day" +%s)
export SOURCE_DATE_EPOCH

# sources FOLDER: what is built from, as fresh files; a build leaves its traces beside them.
sources() {
    mkdir -p "$1"
    tar -C "$here" -cf - --sort=name --mode=u=rwX,go=rX --exclude=__pycache__ --exclude='*.egg-info' pyproject.toml \
        constraints.txt config.schema.json README.md ARCHITECTURE.md CHANGELOG.md SECURITY.md LICENSE \
        contour drivers service packaging docs | tar -C "$1" -xf -
}

# tools: $TOOLS is a Python with what builds, in the tested versions; made here unless it is given.
tools() {
    [ -z "${TOOLS:-}" ] || return 0
    "${PYTHON:-python3}" -m venv "$work/tools"
    TOOLS=$work/tools/bin/python
    export TOOLS
    "$TOOLS" -m pip --disable-pip-version-check --quiet install --constraint "$here/constraints.txt" \
        setuptools build cyclonedx-bom
}

# dependencies FOLDER: their wheels; one whose hash is not noted is refused. $WHEELS: taken from there, without a network.
dependencies() {
    "${PYTHON:-python3}" -m venv "$work/pip"
    "$work/pip/bin/python" -m pip --disable-pip-version-check --quiet download --only-binary :all: --require-hashes \
        ${WHEELS:+--no-index --find-links "$WHEELS"} --requirement "$here/packaging/requirements.txt" --dest "$1"
}

# ours FOLDER: our wheel and source distribution, put into FOLDER.
ours() {
    sources "$work/ours"
    "$TOOLS" -m build --no-isolation --wheel --sdist --outdir "$work/built" "$work/ours" > /dev/null
    cp "$work"/built/*.whl "$1/"
    # setuptools leaves in it when and by whom it was packed.
    mkdir "$work/sdist"
    tar -C "$work/sdist" -xzf "$work/built/combtrace-$version.tar.gz"
    tar -C "$work/sdist" -cf - --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$SOURCE_DATE_EPOCH" \
        "combtrace-$version" | gzip -9n > "$1/combtrace-$version.tar.gz"
}
