#!/usr/bin/env bash
# Installs a build, then configures, builds and runs examples/render_to_memory against it.
#
#   package_test.sh CMAKE BUILD_DIR SOURCE_DIR WORK_DIR COMPILER
set -euo pipefail
cmake=$1 build=$2 source=$3 work=$4 compiler=$5

rm -rf "$work"
"$cmake" --install "$build" --prefix "$work/prefix" >/dev/null
"$cmake" -G Ninja -S "$source/examples/render_to_memory" -B "$work/build" \
  -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_PREFIX_PATH="$work/prefix"
"$cmake" --build "$work/build"

if grep -rlF "$source/include" "$work/prefix/lib"*/cmake "$work/prefix"/lib*/*/cmake 2>/dev/null; then
  echo "the installed package points at the source tree" >&2
  exit 1
fi

cd "$work"
export GAMER_DATA=$work/prefix/share/gamer
build/render_to_memory
