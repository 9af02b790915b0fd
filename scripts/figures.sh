#!/usr/bin/env bash
# Makes docs/gallery.md and its pictures docs/images/gallery_*.png anew.
# Usage: scripts/figures.sh [FIGURE...]
#
# GAMER_BIN is the folder of gamer and gutil; where it is not given they are built.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if [[ -z ${GAMER_BIN:-} ]]; then
  scripts/setup.sh
  export GAMER_BIN=build/release
fi
exec python3 scripts/figures.py "$@"
