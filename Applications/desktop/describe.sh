#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# describe.sh PROGRAM FOLDER COMMAND|OTHER...: what the program echorama says of itself, as files of FOLDER: manual pages, completion for bash,
# and for each command a script that 3D Slicer lists as a module; of other programs (paths) the manual page.
set -eu
program=$1 folder=$2
shift 2
rm -rf "$folder"
mkdir -p "$folder/man1" "$folder/slicer"
page() { # NAME PROGRAM...
  page=$folder/man1/$1.1
  shift
  "$@" --man >"$page"
  gzip -9n "$page"
}
"$program" --completion >"$folder/echorama"
page echorama "$program"
for command; do
  case $command in
    */*)
      page "${command##*/}" "$command"
      continue
      ;;
  esac
  page "echorama-$command" "$program" "$command"
  case $command in
    calibrate | track | view | info) ;; # no forms: commands of commands, without an end, without a result
    *)
      printf '#!/bin/sh\nexec echorama %s "$@"\n' "$command" >"$folder/slicer/echorama-$command"
      chmod +x "$folder/slicer/echorama-$command"
      ;;
  esac
done
