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
size = 720
[camera]
projection = "sky"
center = [185.7288, 15.8222]
pixel_scale = 0.7
[spectrum]
bands = ["bessell_b", "bessell_v", "red_halpha"]
[photometry]
reference_band = "sdss_i"
[sampling]
tolerance = 1e-2
PAR
gamer=build/release/gamer gutil=build/release/gutil
"$gamer" background "$work/sky.par" --faintest 23.5 --seed 4 > "$work/sky.lst"
# The galaxy in front: distance 16 Mpc.
echo "ngc4321 185.7288 15.8222 0.0037 78 9.2 30 153 - 1" >> "$work/sky.lst"
"$gamer" "$work/sky.par" "$work/sky.lst" --output "$work/sky.fits" --overwrite --quiet
"$gutil" convolve --psf moffat --beta 3 --fwhm 1.6 --unit arcsec "$work/sky.fits" "$work/sky_seen.fits" --overwrite
# A telescope of 2.5 m with exposures of 20 minutes: electrons of magnitude 0 in a second, and the sky.
"$gutil" noise --exposure 1200 --exposures 4 --zero-point 25.1,25.0,24.7 --sky 22.4,21.5,20.8 --read-noise 5 \
  "$work/sky_seen.fits" "$work/sky_observed.fits" --overwrite
"$gutil" rgb --method auto --brightness 1.2 --contrast 3 --saturation 1.2 --bits 8 \
  "$work/sky_observed.fits" docs/images/ngc4321_sky.png --overwrite
