#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# describe.sh PROGRAM FOLDER COMMAND...: what the program echorama says of itself, as files of FOLDER: manual pages, completion for bash, and
# for each command a script that 3D Slicer lists as a module.
set -eu
program=$1 folder=$2
shift 2
rm -rf "$folder"
mkdir -p "$folder/man1" "$folder/slicer"
"$program" --completion >"$folder/echorama"
"$program" --man | gzip -9n >"$folder/man1/echorama.1.gz"
for command; do
  "$program" "$command" --man | gzip -9n >"$folder/man1/echorama-$command.1.gz"
  case $command in
    calibrate | track | view | info) ;; # no forms: commands of commands, without an end, without a result
    *)
      printf '#!/bin/sh\nexec echorama %s "$@"\n' "$command" >"$folder/slicer/echorama-$command"
      chmod +x "$folder/slicer/echorama-$command"
      ;;
  esac
done
