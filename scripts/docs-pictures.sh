#!/usr/bin/env bash
# Makes the pictures of the README anew: docs/images/<scene>.png of every shipped scene.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

scripts/setup.sh
mkdir -p docs/images
for list in scenes/*.lst; do
  name=$(basename "$list" .lst)
  size=256
  if [[ $name == ngc4321 ]]; then size=512; fi
  build/release/gamer "scenes/$name.par" "$list" --output "docs/images/$name.png" --overwrite \
    --set "image.size=$size" --quiet
done
