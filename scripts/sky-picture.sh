#!/usr/bin/env bash
# Makes docs/images/ngc4321_sky.png: M100 as a survey's camera sees it, with stars, galaxies behind it, seeing,
# sky and noise.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/setup.sh
work=build/pictures
mkdir -p docs/images "$work"
cat > "$work/sky.par" << 'PAR'
[image]
size = 960
[camera]
projection = "sky"
center = [185.7288, 15.8222]
pixel_scale = 0.5
[spectrum]
bands = ["sdss_g", "sdss_r", "sdss_i"]
[photometry]
reference_band = "sdss_i"
[sampling]
tolerance = 1e-2
PAR
gamer=build/release/gamer gutil=build/release/gutil
"$gamer" background "$work/sky.par" --faintest 24.5 --seed 4 > "$work/sky.lst"
# The galaxy in front: distance 16 Mpc.
echo "ngc4321 185.7288 15.8222 0.0037 105 9.2 30 153 - 1" >> "$work/sky.lst"
"$gamer" "$work/sky.par" "$work/sky.lst" --output "$work/sky.fits" --overwrite --quiet
