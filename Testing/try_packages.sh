#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# try_packages.sh FOLDER: installs the Debian packages in FOLDER (./run package makes them), tries what they hold, and removes them. As
# root, in a system that may be thrown away: a container, or what debootstrap made.
set -uo pipefail
debs=$(cd "${1:?where are the packages?}" && pwd)
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
export DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 QT_QPA_PLATFORM=offscreen
if dpkg-query -W 'echorama*' >/dev/null 2>&1; then
  echo "try_packages: Echorama is installed here; this would remove it" >&2
  exit 2
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
chmod 755 "$work" # apt reads as another user
cd "$work"

failed=0
try() { # NAME COMMAND...
  local name=$1
  shift
  (set -e; "$@") >"$work/said" 2>&1 # not in the condition below: bash forgets set -e there
  if [ $? = 0 ]; then
    echo "ok      $name"
  else
    echo "FAILED  $name"
    tail -n 20 "$work/said" | sed 's/^/        /'
    failed=$((failed + 1))
  fi
}
apt() { apt-get install -y -qq --no-install-recommends "$@"; }
files() { find /etc /opt /usr /var -path /var/cache/apt -prune -o -path /var/cache/man -prune -o -path /var/lib/apt -prune -o -path /var/lib/dpkg -prune -o -path /var/log -prune -o -print | sort; }

# What the packages ask for, and nothing of theirs: what is here afterwards and was not before is then ours.
needs() {
  local deb
  for deb in "$@"; do dpkg-deb -f "$deb" Depends; done | sed 's/, /\n/g' | grep -v '^echorama' | sort -u | paste -sd,
}
satisfy() { apt-get satisfy -y -qq --no-install-recommends "$(needs "$@")"; }

pipeline() {
  echorama --version
  echorama phantom -o demo --spacing 2.5 --seed 5
  echorama align demo/volume_*.mha -o demo/poses.json --points 4000 --sound-speed-error 0
  echorama stitch demo/volume_*.mha --poses demo/poses.json -o demo/stitched.mha
  echorama embed demo/stitched.mha -o demo/embedded.mha
  echorama convert demo/stitched.mha demo/stitched.vdb
  echorama info demo/stitched.vdb | grep OpenVDB
  echorama info demo/embedded.mha | grep -i voxels
}
cpu_levels() { # the loader takes the kernels of the highest level that the machine runs; all stitch the same voxels
  local loader=/lib64/ld-linux-x86-64.so.2 program level folder
  program=$(command -v echorama)
  for level in x86-64-v2 x86-64-v3 x86-64-v4; do
    "$loader" --help | grep "$level (supported" || continue
    folder=glibc-hwcaps/$level
    [ "$level" != x86-64-v2 ] || folder=x86_64-linux-gnu
    taken_from "$folder" "$loader" --glibc-hwcaps-mask "$level" "$program" stitch demo/volume_*.mha --poses demo/poses.json -o level.mha
    cmp level.mha demo/stitched.mha
  done
  taken_from "$folder" "$program" info demo/stitched.vdb
}
taken_from() { # FOLDER COMMAND...: all kernels that the command loads, one at least, lie there
  LD_DEBUG=files "${@:2}" 2>&1 | sed -n 's/.*calling init: \(.*libEchorama[A-Za-z]*Kernels\.so.*\)/\1/p' >kernels
  grep "/$1/libEchorama" kernels
  ! grep -v "/$1/libEchorama" kernels
}
python_package() {
  cat >python.py <<'END'
import echorama
stitcher = echorama.vtkUltrasoundStitcher()
for x in (0, 20):
    source = echorama.vtkUltrasoundPhantomSource()
    source.SetSpacingMm(4)
    source.SetPosition(x, 0, 0)
    stitcher.AddInputConnection(source.GetOutputPort())
stitcher.Update()
grey = stitcher.GetOutput().GetPointData().GetScalars().GetRange()
print(echorama.__file__, grey)
assert grey[1] > grey[0]
END
  /usr/bin/python3 python.py
}
versions() { for name in workbench simulator leds; do "echorama-$name" --version; done; }
manual() {
  local command
  for command in echorama echorama-workbench echorama-simulator echorama-leds $(commands | sed 's/^/echorama-/'); do
    man "$command" | grep -A 1 '^NAME' | grep "$command"
  done
}
commands() { echorama --help | sed -n 's/^  \([a-z][a-z-]*\) .*/\1/p'; }
completion() { # as readline asks
  bash -c '. /usr/share/bash-completion/bash_completion; _completion_loader echorama
    COMP_WORDS=(echorama sti) COMP_CWORD=1 COMP_LINE="echorama sti" COMP_POINT=12
    set -- $(complete -p echorama)
    while [ "$1" != -F ]; do shift; done
    "$2" echorama sti echorama; echo "${COMPREPLY[*]}"; [[ ${COMPREPLY[*]} = stitch* ]]'
}
desktop() {
  local entry
  for entry in $(dpkg -L echorama | grep '\.desktop$'); do
    desktop-file-validate "$entry"
    command -v "$(sed -n 's/^Exec=\([^ ]*\).*/\1/p' "$entry")"
    test -e "/usr/share/icons/hicolor/scalable/apps/$(sed -n 's/^Icon=//p' "$entry").svg"
  done
  gio info -a standard::content-type demo/stitched.mha | grep application/x-metaimage
  gio mime application/x-metaimage | grep org.echorama.Workbench.desktop
}
project() {
  cp -r "$source/Examples/cpp" .
  cmake -S cpp -B cpp/build
  cmake --build cpp/build
  cpp/build/make_phantom | grep 'mean grey'
  cpp/build/stitch_volumes demo/volume_?.mha | grep 'wrote stitched.vti'
}
plugin() {
  cat >plugin.py <<END
import glob
from paraview.simple import *
LoadPlugin("$(dpkg -L echorama-paraview | grep '/Echorama\.so$')", remote=False, ns=globals())
stitched = UltrasoundStitcher(Input=[UltrasoundReader(FileName=name) for name in glob.glob("demo/volume_*.mha")])
stitched.UpdatePipeline()
print("stitched", stitched.PointData["Intensity"].GetRange()[1] > 0)
END
  pvbatch plugin.py 2>&1 | tee /dev/stderr | grep 'stitched True'
}
licences() {
  local deb
  for deb in "$debs"/*.deb; do grep -q 'BSD 3-Clause' "/usr/share/doc/$(dpkg-deb -f "$deb" Package)/copyright"; done
}
remove() {
  apt-get purge -y -qq $(dpkg-query -W -f '${db:Status-Abbrev} ${Package}\n' 'echorama*' | sed -n 's/^ii *//p')
  files >after
  diff before after
}

apt-get update -qq
try "plain apt install resolves" apt-get install -s "$debs"/*.deb
try "what they need is there" satisfy "$debs"/*.deb
try "tools of these checks" apt bash-completion build-essential cmake desktop-file-utils libglib2.0-bin man-db
files >before
try "install" apt "$debs"/*.deb
try "licences" licences
try "as they were packed" dpkg --verify echorama echorama-libraries echorama-python echorama-dev
try "phantom, align, stitch, embed, convert, info" pipeline
try "kernels for each level of CPUs" cpu_levels
try "Python package" python_package
try "workbench, simulator, leds" versions
try "manual pages" manual
try "completion" completion
try "desktop entries and file types" desktop
try "find_package(Echorama)" project
try "nothing stays" remove
try "python3-paraview in the place of python3-vtk9" apt python3-paraview
files >before
try "install the plugin" apt "$debs"/echorama-libraries_* "$debs"/echorama-paraview_*
try "pvbatch" plugin
try "nothing of the plugin stays" remove
echo "$failed failed"
[ "$failed" = 0 ]
