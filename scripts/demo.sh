#!/usr/bin/env bash
# Builds gamer and renders NGC 4321 (M100): a FITS file of three wavelengths and a picture of it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/setup.sh

gamer=build/release/gamer
fits=build/demo/ngc4321.fits
picture=build/demo/ngc4321.png
mkdir -p build/demo

is_current() {
  [[ -f $1 && -z $(find "$gamer" scenes galaxies seds -type f -newer "$1" -print -quit) ]]
}

for output in "$fits" "$picture"; do
  if ! is_current "$output"; then
    "$gamer" scenes/ngc4321.par scenes/ngc4321.lst --output "$output" --overwrite
  fi
done
echo "FITS file: $PWD/$fits"
echo "Picture:   $PWD/$picture"
