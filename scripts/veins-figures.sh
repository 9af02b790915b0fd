#!/usr/bin/env bash
# Makes the figures of docs/veins.md anew: docs/images/veins_*.png. Each is one render of a scene in which galaxies that
# differ in a few keys stand side by side.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

gamer=${GAMER:-build/release/gamer}
gutil=${GUTIL:-build/release/gutil}
work=build/veins
mkdir -p "$work" docs/images
arms='model = "logarithmic"
pitch_angle = 17.853
count = 2'
plain='displacement = 0
noise_contrast = 0'

# begin <columns>: a new figure.
begin() {
  columns=$1
  count=0
  echo 'galaxy x y z seed' > "$work/figure.lst"
}

# panel <keys> [arms]: the next galaxy, light in the veins' place, seen as a column density.
panel() {
  local name=panel$count
  {
    printf '[arms]\n%s\n' "${2:-$arms}"
    printf '[[component]]\nclass = "veins_light"\nname = "veins"\nsed = "flat"\n'
    printf 'z0 = 0.012\nrh = 0.95\n%s\n' "$1"
    # The clumpiness of dust, where the keys give none.
    [[ $1 == *clumpiness* ]] || echo 'clumpiness = 1'
    [[ $1 == *density_low* ]] || echo 'density_low = 0.6'
  } > "$work/$name.toml"
  echo "$name $(awk -v n=$count -v c="$columns" 'BEGIN {print 1.9 * (n % c), -1.9 * int(n / c), 0, 1}')" \
    >> "$work/figure.lst"
  count=$((count + 1))
}

# finish <figure>
finish() {
  local rows=$(((count + columns - 1) / columns))
  local x y
  x=$(awk -v c="$columns" 'BEGIN {print 0.95 * (c - 1)}')
  y=$(awk -v r="$rows" 'BEGIN {print -0.95 * (r - 1)}')
  cat > "$work/figure.par" << PAR
[image]
size = [$((110 * columns)), $((110 * rows))]
[camera]
projection = "orthographic"
position = [$x, $y, 10]
target = [$x, $y, 0]
up = [0, 1, 0]
width = $(awk -v c="$columns" 'BEGIN {print 1.9 * c}')
[sampling]
tolerance = 5e-3
[spectrum]
wavelengths = [5500]
PAR
  "$gamer" "$work/figure.par" "$work/figure.lst" --output "docs/images/veins_$1.png" --overwrite --quiet
}

# Bizard 2018, figure 3.5: lines of u and v, for a constant pitch, more arms, and a bar.
lines='vein_width = 0.025
spur_width = 0.08
spur_angle = 90
spur_curvature = 0
spur_length = 3
spur_strength = 0.6
spur_variation = 0
density_low = 0.2'
begin 3
panel "$plain
$lines"
panel "$plain
$lines" 'model = "logarithmic"
pitch_angle = 12.579
count = 4'
panel "$plain
$lines" 'model = "ringermacher-mead"
winding_b = 20
winding_n = 1.5
scale = 1.6'
finish coordinates

# 3.7: veins along the arms.
begin 3
for width in 0.04 0.1 0.2; do
  panel "$plain
spur_number = 0
vein_width = $width"
done
finish arms

# 3.8: spurs; their number, angle, curvature, length, width and variation.
begin 4
for keys in 'spur_number = 8' 'spur_number = 30' 'spur_angle = 90' 'spur_angle = 30' \
  'spur_curvature = 0' 'spur_curvature = 5' 'spur_length = 0.4' 'spur_length = 2' \
  'spur_width = 0.05' 'spur_width = 0.25' 'spur_strength = 0.4' 'spur_variation = 0'; do
  panel "$plain
$keys"
done
finish spurs

# 3.9: noise that displaces veins, and noise that multiplies their density.
begin 4
for keys in 'displacement = 0.03' 'displacement = 0.12' 'displacement_frequency = 6' \
  'displacement_octaves = 4'; do
  panel "noise_contrast = 0
$keys"
done
for keys in 'noise_contrast = 0.12' 'noise_contrast = 0.4' 'noise_frequency = 5' \
  'spectral_index = 2'; do
  panel "$keys"
done
for keys in 'octaves = 3' 'isotropic_scale = 0.15' 'clumpiness = 6' 'density_low = 2.5'; do
  panel "$keys"
done
finish noise

# 3.10: clouds along a direction; no seam anywhere.
flat='vein_width = 1
spur_number = 0
displacement = 0
isotropic_scale = 0.01
noise_contrast = 0.3'
begin 4
for keys in 'anisotropy = 1' 'anisotropy = 3' 'anisotropy = 8' 'anisotropy = 3
anisotropy_angle = 0'; do
  panel "$flat
$keys"
done
finish anisotropy

# 3.11: opacity, in front of half of a smooth disk.
begin 3
for depth in 0.5 2 8; do
  panel ""
  cat > "$work/panel$((count - 1)).toml" << TOML
[arms]
$arms
[[component]]
class = "disk"
sed = "flat"
noise = false
z0 = 0.1
rh = 0.95
arm_width = 0
[[component]]
class = "veins"
z0 = 0.012
rh = 0.95
optical_depth = $depth
TOML
done
finish opacity

# The column density between two arms: map, spectrum and width.
scripts/veins-spectrum.sh "$work" "$gamer" "$gutil"
cp "$work/between.png" docs/images/veins_between.png
cp "$work/spectrum.png" docs/images/veins_spectrum.png
