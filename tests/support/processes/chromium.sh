#!/bin/sh
# Debian's Chromium, but for the pages of its own that it loads behind the address bar of each window: they take more of
# the processor than ours. Of several --disable-features it heeds the last only, so these join those of Playwright.
for argument; do
    shift
    case $argument in
    --disable-features=*) argument="$argument,WebUIOmniboxPopup,WebUIOmniboxAimPopup" ;;
    esac
    set -- "$@" "$argument"
done
exec chromium "$@"
