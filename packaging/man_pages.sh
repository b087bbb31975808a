#!/bin/sh
# man_pages.sh COMMAND FOLDER: a manual page of combtrace and one of each of its commands, from what --help prints
set -eu
command=${1:?which command?}
folder=${2:?which folder?}
mkdir -p "$folder"
# A usage on one line is a synopsis to help2man.
export COLUMNS=1000 LC_ALL=C.UTF-8
version=$("$command" --version | cut -d ' ' -f 2)
page() { # NAME DESCRIPTION COMMAND...
    name=$1
    description=$2
    shift 2
    help2man --no-info --no-discard-stderr --manual=combtrace --source="combtrace $version" \
        --version-string="$version" --name="$description" --output="$folder/$name.1" "$*"
    # A page's name has no blank: whatis would not find it.
    sed -i "s/^\.TH .* \"1\"/.TH $(echo "$name" | tr a-z A-Z) \"1\"/; /^\.SH NAME/,/^\.SH/s/^combtrace.* \\\\-/$name \\\\-/" \
        "$folder/$name.1"
}
page combtrace "outline of a honeycomb block, from a camera to a cutting machine" "$command"
"$command" completion fish | sed -n "s/.*__fish_use_subcommand -a \([a-z-]*\) -d '\(.*\)'$/\1 \2/p" |
    while read -r name description; do page "combtrace-$name" "$description" "$command" "$name"; done
