#!/usr/bin/env bash
# Draws the figures of docs/noise.md anew: docs/images/noise_*.png.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

cmake --preset release > /dev/null
cmake --build --preset release --target noise_figures
build/release/bench/noise_figures docs/images
