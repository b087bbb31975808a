#!/bin/sh
# Stands where LinuxCNC's screen would: the session lasts as long as this runs.
echo $$ >"$(dirname "$0")/display.pid"
exec sleep 3600
