#!/usr/bin/env bash
# From a scene to an observed picture: renders Messier 100 on the sky in three bands, one file each,
# stacks them, convolves with a PSF of 0.1 arcsec, adds the noise of 4 x 1000 s and makes the picture.
#
#   scripts/survey.sh [folder]      build/survey by default
#
# GAMER_BIN is the folder of gamer and gutil; where it is not given they are built.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if [[ -z ${GAMER_BIN:-} ]]; then
  scripts/setup.sh
  GAMER_BIN=build/release
fi
gamer=$GAMER_BIN/gamer
gutil=$GAMER_BIN/gutil
folder=${1:-build/survey}
mkdir -p "$folder"

# Zero points of the ACS on HST (AB magnitude of 1 electron/s, Sirianni et al. 2005, PASP 117, 1049)
# and a sky of low zodiacal light, in the order of the cube: blue to red.
zero_points=25.673,26.486,25.937
skies=23.3,22.6,22.6

"$gamer" scenes/survey.par scenes/survey.lst --output "$folder/m100.fits" --truth --overwrite
"$gutil" stack --order wavelength "$folder"/m100_hst_f*.fits "$folder/cube.fits" --overwrite
"$gutil" convolve --psf moffat --beta 3.5 --fwhm 0.1 --unit arcsec \
  "$folder/cube.fits" "$folder/seen.fits" --overwrite
"$gutil" noise --exposure 4000 --exposures 4 --zero-point $zero_points --sky $skies --read-noise 4.5 \
  --variance "$folder/seen.fits" "$folder/observed.fits" --overwrite
"$gutil" rgb "$folder/observed.fits[0]" "$folder/observed.png" --bits 8 --scale 0.6,0.9,2.2 \
  --stretch 5 --q 8 --overwrite
"$gutil" photometry --radius 8 --unit arcsec "$folder/observed.fits[0]"
echo "Picture: $folder/observed.png"
