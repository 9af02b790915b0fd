#!/usr/bin/env bash
# Makes the pictures of the README anew: docs/images/<scene>.png of every shipped scene, of the survey's
# as it is observed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/setup.sh
mkdir -p docs/images
for list in scenes/*.lst; do
  name=$(basename "$list" .lst)
  [[ $name == survey ]] && continue
  settings=(--set image.size=256)
  case $name in
    ngc4321) settings=(--set image.size=512) ;;
    milky_way_inside) settings=(--set "image.size=[512, 256]") ;;
    field) settings=(--set "image.size=[440, 264]" --set camera.pixel_scale=0.0818) ;;
  esac
  build/release/gamer "scenes/$name.par" "$list" --output "docs/images/$name.png" --overwrite \
    "${settings[@]}" --quiet
done
scripts/survey.sh build/survey > /dev/null
cp build/survey/observed.png docs/images/survey.png
