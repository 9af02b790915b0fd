#!/usr/bin/env bash
# Builds everything and runs the test suite.
#
#   scripts/test.sh [--werror] [ctest options]
#
# --werror builds apart, in build/ci, with warnings as errors.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

build=build/release
options=()
if [[ ${1:-} == --werror ]]; then
  shift
  build=build/ci
  options=(-DGAMER_WERROR=ON)
fi
scripts/setup.sh --tests --build "$build" "${options[@]}"

# Open MPI starts nothing as root, as in a container, unless told twice.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
ctest --test-dir "$build" --output-on-failure --parallel "$(nproc)" "$@"
