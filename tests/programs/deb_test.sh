#!/usr/bin/env bash
# Makes the Debian package of a build, and looks at its contents and its programs. The exit code is
# 77, for a skipped test, where dpkg-deb is missing.
#
#   deb_test.sh CPACK BUILD_DIR PREFIX WORK_DIR
set -euo pipefail
cpack=$1 build=$2 prefix=$3 work=$4
command -v dpkg-deb dpkg-shlibdeps >/dev/null || exit 77

rm -rf "$work"
mkdir -p "$work"
"$cpack" -G DEB --config "$build/CPackConfig.cmake" -B "$work" >"$work/log" 2>&1 ||
  { cat "$work/log" >&2; exit 1; }
package=$(ls "$work"/gamer_*.deb)

dpkg-deb --contents "$package" | sed 's/.* \.\//\//' >"$work/contents"
for file in bin/gamer bin/gutil share/man/man1/gamer.1 share/man/man1/gutil.1 \
  $([[ ! -e $build/gstudio ]] || echo bin/gstudio share/man/man1/gstudio.1) \
  share/gamer/galaxies/ngc4321.toml share/gamer/seds/E.sed include/gamer/job/job.h \
  lib/cmake/gamer/gamerConfig.cmake; do
  # Libraries of some systems are in lib/<architecture>.
  grep -qE "^$prefix/${file/lib\//lib/(.*/)?}(.gz)?\$" "$work/contents" ||
    { echo "the package lacks $prefix/$file" >&2; exit 1; }
done
dpkg-deb --field "$package" Depends | grep -q libcfitsio
[[ $(dpkg-deb --field "$package" Package) == gamer ]]

dpkg-deb --extract "$package" "$work/root"
GAMER_DATA=$work/root$prefix/share/gamer "$work/root$prefix/bin/gamer" --list-galaxies | grep -q '^ *ngc4321'
[[ "gamer $(dpkg-deb --field "$package" Version)" == "$("$work/root$prefix/bin/gamer" --version | head -n 1 | cut -d ' ' -f 1,2)" ]]
