#!/usr/bin/env bash
# Installs a build, compares the data, then configures, builds and runs the examples against it.
#
#   package_test.sh CMAKE BUILD_DIR SOURCE_DIR WORK_DIR COMPILER COMPILER_FLAGS
set -euo pipefail
cmake=$1 build=$2 source=$3 work=$4 compiler=$5 flags=$6

rm -rf "$work"
"$cmake" --install "$build" --prefix "$work/prefix" >/dev/null
if grep -rF --include='*.cmake' -e "$source/" -e "$build/" "$work/prefix"; then
  echo "the installed package points at the source or the build tree" >&2
  exit 1
fi

for folder in seds bandpasses galaxies instruments scenes; do
  diff -r "$source/$folder" "$work/prefix/share/gamer/$folder"
done

for example in render_to_memory new_component; do
  "$cmake" -G Ninja -S "$source/examples/$example" -B "$work/$example" \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags" \
    -DCMAKE_PREFIX_PATH="$work/prefix"
  "$cmake" --build "$work/$example"
done

cd "$work"
data=$work/prefix/share/gamer
GAMER_DATA=$data render_to_memory/render_to_memory "$data/scenes/ngc4321.par" "$data/scenes/ngc4321.lst" |
  tee totals.txt
[[ $(grep -cE '^(4300|5750|7400)A: total [0-9.]*[1-9]' totals.txt) -eq 3 ]]
# Bands are no wavelengths.
GAMER_DATA=$data render_to_memory/render_to_memory "$data/scenes/survey.par" "$data/scenes/survey.lst" |
  tee totals.txt
[[ $(grep -cE '^hst_f(435|606|814)w: total [0-9.e+]*[1-9]' totals.txt) -eq 3 ]]

GAMER_DATA=$data new_component/new_component | tee egg.txt
grep -qE '^flux / asked = (1|1\.000[0-4]|0\.999[6-9])' egg.txt
