#!/usr/bin/env bash
# Makes the pictures of docs/views.md anew: docs/images/view_<projection>.png.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

mkdir -p docs/images
folder=$(mktemp -d)
trap 'rm -r "$folder"' EXIT
cat > "$folder/inside.par" <<'END'
[camera]
position = [0.45, 0.2, 0.02]
target = [0, 0, 0]
up = [0, 0, 1]
[spectrum]
wavelengths = [4400, 5500, 6600]
[sampling]
tolerance = 0.01
END
cat > "$folder/inside.lst" <<'END'
galaxy  x y z
ngc4321 0 0 0
ngc1300 2 1 1.5
END
view() {
  build/release/gamer "$folder/inside.par" "$folder/inside.lst" --quiet --overwrite \
    --output "docs/images/view_$1.png" --set "camera.projection=$1" --set "image.size=$2"
}
view equirectangular '[280, 140]'
view fisheye 200
view cubemap 70
