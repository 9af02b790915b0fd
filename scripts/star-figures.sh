#!/usr/bin/env bash
# Makes the figures of docs/stars.md anew: docs/images/stars-*.png.
# Usage: scripts/star-figures.sh
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
images=docs/images
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
mkdir -p "$images"

# A field that fills the view; arguments: name, more of its keys.
field() {
  cat > "$work/$1.toml" <<END
[arms]
model = "none"
[[component]]
class = "starfield"
z0 = 0.3
rh = 1
$2
END
  printf 'galaxy x y z\n./%s 0 0 0\n' "$1" > "$work/$1.lst"
}
cat > "$work/view.par" <<END
[image]
size = 200
[camera]
projection = "orthographic"
position = [0, 0, 5]
up = [0, 1, 0]
width = 0.5
[spectrum]
wavelengths = [4300, 5750, 7400]
[sampling]
stars_per_pixel = 1e6
END
# Arguments: picture, parameters, scene, settings.
draw() {
  local picture=$1 parameters=$2 scene=$3
  shift 3
  local settings=()
  for setting in "$@"; do settings+=(--set "$setting"); done
  "$gamer" "$parameters" "$work/$scene.lst" -o "$work/$picture.fits" --quiet "${settings[@]}"
  "$gutil" rgb --method auto --bits 8 "$work/$picture.fits" "$images/stars-$picture.png" --overwrite
}
view=$work/view.par

field uniform 'number = 1e4
luminosity_low = 1
luminosity_high = 10
noise = false'
draw uniform "$view" uniform
field biased 'number = 5e4
luminosity_low = 0.01
luminosity_high = 1e4
luminosity_slope = 1.9
noise = false'
draw biased "$view" biased
draw radius "$view" biased stars.white_point=60 stars.largest_radius=5
field modulated 'number = 6e4
luminosity_low = 0.1
luminosity_high = 1e3
luminosity_slope = 2
noise = { theta = "linear", exponent = 3, offset = 0, k0 = 2, frequency_scale = 3, octaves = 5 }'
draw modulated "$view" modulated
draw antialiased "$view" biased image.size=100 camera.width=0.12
draw aliased "$view" biased image.size=100 camera.width=0.12 stars.antialiased=false

# From within 1e11 stars and dust, and the same as smooth light.
cp scenes/milky_way_inside.lst "$work"
inside=('image.size=[330, 150]' 'camera.projection="perspective"' camera.fov=80 sampling.tolerance=0.01)
draw inside scenes/milky_way_inside.par milky_way_inside "${inside[@]}" sampling.stars_per_pixel=2
draw smooth scenes/milky_way_inside.par milky_way_inside "${inside[@]}" sampling.stars_per_pixel=0

# The shader galaxy in its five steps.
parts=(1 1 3 4 5)
for step in 1 2 3 4 5; do
  awk -v last="${parts[step - 1]}" '/^\[\[component\]\]/ { ++n } n <= last' galaxies/shader_galaxy.toml \
    > "$work/shader_galaxy.toml"
  if [[ $step == 1 ]]; then sed -i 's/^twirl.*/twirl = 0/; s/^arm_width.*/arm_width = 0/' "$work/shader_galaxy.toml"; fi
  printf 'galaxy x y z\n./shader_galaxy 0 0 0\n' > "$work/shader_galaxy.lst"
  draw "step$step" scenes/shader_galaxy.par shader_galaxy image.size=200 stars.largest_radius=1.5
done
