#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# paraview-overlay.sh DIR: makes a private prefix in DIR in which find_package(ParaView) and ParaView's Python work
# beside Debian's python3-vtk9.
#
# On Debian 12 and 13 alike python3-paraview conflicts with python3-vtk9, yet ParaView's CMake package wants files that only it ships. So that
# package is downloaded and unpacked in DIR/deb, not installed, and DIR/prefix links it together with the system's files.
set -eu
mkdir -p "$1"
dir=$(cd "$1" && pwd)
lib=lib/x86_64-linux-gnu
prefix=$dir/prefix/usr
root=$dir/deb/root/usr
[ ! -e "$dir/complete" ] || exit 0

rm -rf "$dir/prefix" "$dir/deb"
mkdir -p "$dir/deb" "$prefix/$lib/cmake" "$prefix/bin"
(cd "$dir/deb" && apt-get -o APT::Sandbox::User=root download python3-paraview >/dev/null && dpkg -x python3-paraview_*.deb root)
# ParaView's CMake package knows the modules by names without Debian's tag (.cpython-313-x86_64-linux-gnu).
find "$root/lib/python3" -name '*.cpython-*.so' | while read -r module; do
  [ -e "${module%%.cpython-*}.so" ] || ln -s "$(basename "$module")" "${module%%.cpython-*}.so"
done

ln -s /usr/include "$prefix/include"
ln -s /usr/share "$prefix/share"
ln -s "$root/lib/python3" "$prefix/lib/python3"
for file in /usr/$lib/*; do
  name=$(basename "$file")
  case $name in cmake | vtk) ;; *) ln -s "$file" "$prefix/$lib/$name" ;; esac
done
for file in /usr/bin/*-pv[0-9]* /usr/bin/pv* /usr/bin/paraview* "$root"/bin/*; do
  [ ! -e "$file" ] || ln -sfn "$file" "$prefix/bin/"
done
ln -s "$root/$lib/vtk" "$prefix/$lib/vtk"
# A real copy: the targets files in it resolve symlinks before they look around.
cp -r "/usr/$lib"/cmake/paraview-* "$prefix/$lib/cmake/"
touch "$dir/complete"
