#!/usr/bin/env bash
# Makes the pictures of docs/views.md anew: docs/images/view_<projection>.png, of scenes/milky_way_inside.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

gamer=${GAMER:-build/release/gamer}
gutil=${GUTIL:-build/release/gutil}
scene=scenes/milky_way_inside
mkdir -p docs/images
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
# view <projection> <size> [output]: only gamer itself draws the six sides of a cube as one picture.
view() {
  "$gamer" $scene.par $scene.lst --quiet --overwrite --output "${3:-$folder/$1.fits}" \
    --set "camera.projection=$1" --set "image.size=$2" --set sampling.tolerance=0.01
}
for view in 'equirectangular [512,256]' 'fisheye 256'; do
  read -r projection size <<< "$view"
  view "$projection" "$size"
  "$gutil" rgb --method auto --bits 8 "$folder/$projection.fits" \
    "docs/images/view_$projection.png" --overwrite
done
view cubemap 80 docs/images/view_cubemap.png
