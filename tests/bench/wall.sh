#!/bin/sh
# For scripts that measure wall time, in a folder named by the variable folder.
# wall COMMAND…: wall seconds, the least of two runs
wall() {
  : >"$folder/seconds"
  for run in 1 2; do
    /usr/bin/env bash -c 'TIMEFORMAT=%R; time "$@" >/dev/null 2>&1' wall "$@" 2>>"$folder/seconds" || return 1
  done
  sort -n "$folder/seconds" | head -1
}
