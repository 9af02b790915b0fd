#!/usr/bin/env bash
# Makes the figures of docs/stars.md anew: docs/images/stars-*.png.
# Usage: scripts/star-figures.sh [gamer program]
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
gamer=${1:-build/release/gamer}
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
# Arguments: picture, scene, settings.
draw() {
  local picture=$1 scene=$2
  shift 2
  local settings=()
  for setting in "$@"; do settings+=(--set "$setting"); done
  "$gamer" "$work/view.par" "$work/$scene.lst" -o "$images/stars-$picture.png" --overwrite --quiet \
    "${settings[@]}"
}

field uniform 'number = 1e4
luminosity_low = 1
luminosity_high = 10
noise = false'
draw uniform uniform
field biased 'number = 5e4
luminosity_low = 0.01
luminosity_high = 1e4
luminosity_slope = 1.9
noise = false'
draw biased biased
draw radius biased stars.white_point=60 stars.largest_radius=5
field modulated 'number = 6e4
luminosity_low = 0.1
luminosity_high = 1e3
luminosity_slope = 2
noise = { theta = "linear", exponent = 3, offset = 0, k0 = 2, frequency_scale = 3, octaves = 5 }'
draw modulated modulated
draw antialiased biased image.size=100 camera.width=0.12
draw aliased biased image.size=100 camera.width=0.12 stars.antialiased=false

# From within 1e11 stars and dust, and the same as smooth light.
cat > "$work/milky.toml" <<END
[arms]
model = "logarithmic"
pitch_angle = 18
count = 2
[[component]]
class = "starfield"
z0 = 0.03
rh = 0.2
arm_width = 2
twirl = 0.5
number = 1e11
[[component]]
class = "dust"
z0 = 0.012
rh = 0.3
arm_width = 5
shift = 15
twirl = 0.5
optical_depth = 2
END
printf 'galaxy x y z\n./milky 0 0 0\n' > "$work/milky.lst"
inside=('image.size=[420, 200]' 'camera.projection="perspective"' 'camera.position=[0, -0.35, 0.01]'
  'camera.up=[0, 0, 1]' camera.fov=80 sampling.stars_per_pixel=2)
sed -i '/^width/d' "$work/view.par"
draw inside milky "${inside[@]}"
draw smooth milky "${inside[@]}" sampling.stars_per_pixel=0

# The shader galaxy in its five steps.
parts=(1 1 2 3 4)
for step in 1 2 3 4 5; do
  awk -v last="${parts[step - 1]}" '/^\[\[component\]\]/ { ++n } n <= last' galaxies/shader_galaxy.toml \
    > "$work/shader_galaxy.toml"
  if [[ $step == 1 ]]; then sed -i 's/^twirl.*/twirl = 0/; s/^arm_width.*/arm_width = 0/' "$work/shader_galaxy.toml"; fi
  printf 'galaxy x y z\n./shader_galaxy 0 0 0\n' > "$work/shader_galaxy.lst"
  "$gamer" scenes/shader_galaxy.par "$work/shader_galaxy.lst" -o "$images/stars-step$step.png" \
    --overwrite --quiet --set image.size=200
done
