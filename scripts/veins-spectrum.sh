#!/usr/bin/env bash
# Maps the column density of M51's dust (galaxies/m51.toml) face on in three places between two arms, and
# measures it as docs/veins.md says: veins-spectrum.sh [FOLDER] [GAMER] [GUTIL] leaves between<n>.fits
# and spectrum<n>.json, and of the first place between.png and spectrum.png.
set -euo pipefail
source=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
work=${1:-build/veins}
gamer=${2:-$source/build/release/gamer}
gutil=${3:-$source/build/release/gutil}
mkdir -p "$work"

# The dust alone, shown as light: its column density.
awk -v RS= -v ORS='\n\n' '/^\[arms\]/ || /class = "veins"\n/' "$source/galaxies/m51.toml" |
  sed -e 's/class = "veins"/class = "veins_light"\nsed = "flat"/' \
    -e 's/^optical_depth.*/clumpiness = 1/' > "$work/m51_dust.toml"
echo 'galaxy x y z seed
m51_dust 0 0 0 1' > "$work/m51_dust.lst"
n=0
# Half way between two lanes: at radius 0.54 in the south-west, at 0.55 in the north-east, at 0.45 in the west.
for place in '-0.45, -0.3' '0.344, 0.429' '-0.433, -0.121'; do
  n=$((n + 1))
  cat > "$work/between.par" << PAR
[image]
size = 256
[camera]
projection = "orthographic"
position = [$place, 10]
target = [$place, 0]
up = [0, 1, 0]
width = 0.25
[spectrum]
wavelengths = [5500]
PAR
  "$gamer" "$work/between.par" "$work/m51_dust.lst" --output "$work/between$n.fits" --overwrite --quiet
  "$gutil" spectrum --window hann --json "$work/between$n.fits" > "$work/spectrum$n.json"
done
"$gutil" spectrum --window hann --plot "$work/spectrum.png" --overwrite "$work/between1.fits" > /dev/null
"$gamer" --from-header "$work/between1.fits" --output "$work/between.png" --overwrite --quiet
