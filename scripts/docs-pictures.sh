#!/usr/bin/env bash
# Makes the pictures of the README anew: docs/images/<scene>.png of every scene that has one. That
# of the survey is made by scripts/survey.sh, those of the Milky Way from inside by
# scripts/views-pictures.sh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/setup.sh
work=build/pictures
mkdir -p docs/images "$work"
for list in scenes/*.lst; do
  name=$(basename "$list" .lst)
  [[ -f docs/images/$name.png && $name != survey ]] || continue
  settings=(--set image.size=256 --set camera.supersample=2)
  case $name in
    ngc4321 | pair) settings[1]=image.size=512 ;;
    m51 | milky_way | shader_galaxy) settings[1]=image.size=384 ;;
    field) settings=(--set "image.size=[440, 264]" --set camera.pixel_scale=0.0818) ;;
  esac
  build/release/gamer "scenes/$name.par" "$list" --output "$work/$name.fits" --overwrite \
    "${settings[@]}" --quiet
  build/release/gutil rgb --method auto --brightness 1.2 --contrast 3 --saturation 1.2 --bits 8 "$work/$name.fits" "docs/images/$name.png" --overwrite
done
scripts/survey.sh build/survey > /dev/null
cp build/survey/observed.png docs/images/survey.png
