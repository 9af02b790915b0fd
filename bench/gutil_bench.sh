#!/usr/bin/env bash
# Time and memory of every operation of gutil on a square image of 32-bit floats, beside a copy of the
# file.
#
#   bench/gutil_bench.sh GUTIL [side [folder]]      4096 pixels, the system's temporary folder
#
# Prints wall-clock seconds, their ratio to `cp` (the median of three), processor seconds, peak
# memory. A folder in memory (/dev/shm) excludes the disk.
set -euo pipefail
gutil=$(realpath "$1")
side=${2:-4096}
folder=$(mktemp -d -p "${3:-${TMPDIR:-/tmp}}")
trap 'rm -rf "$folder"' EXIT
cd "$folder"

"$gutil" psf --psf moffat --beta 3 --fwhm 20 --size 1001 seed.fits
"$gutil" scale --factor 1e6 --bitpix -32 seed.fits galaxy.fits
"$gutil" pad --size "$side,$side" galaxy.fits plain.fits
"$gutil" noise --sigma 0.5 plain.fits in.fits
"$gutil" psf --psf moffat --beta 3 --fwhm 5 --size 65 psf.fits
rm plain.fits

seconds() {  # median of three
  for _ in 1 2 3; do /usr/bin/time -f '%e' "$@" 2>&1 >/dev/null | tail -n 1; done | sort -n | sed -n 2p
}
copy=$(seconds cp in.fits copy.fits)
rm copy.fits
printf '%-44s %8s %6s %8s %8s\n' "$side x $side" seconds ratio CPU MiB
printf '%-44s %8s\n' "cp" "$copy"

while read -r name options; do
  out=out.fits
  case $name in
    rgb) out=out.png ;;
    stats | photometry | spectrum | compare) out= ;;
  esac
  inputs=in.fits
  case $name in
    add | subtract | multiply | average | compare | stack) inputs="in.fits in.fits" ;;
    rgb) inputs="in.fits in.fits in.fits" ;;
  esac
  if ! result=$(/usr/bin/time -f '%e %U %S %M' "$gutil" "$name" $options $inputs $out 2>&1 >/dev/null | tail -n 1); then
    printf '%-44s failed: %s\n' "$name $options" "$result"
    continue
  fi
  read -r wall user system memory <<< "$result"
  awk -v name="$name $options" -v wall="$wall" -v copy="$copy" -v user="$user" -v system_="$system" \
    -v memory="$memory" 'BEGIN { printf "%-44s %8.2f %6.1f %8.2f %8.0f\n", name, wall, wall / (copy > 0 ? copy : 0.01), user + system_, memory / 1024 }'
  rm -f out.fits out.png
done << 'OPERATIONS'
scale --factor 2
add
average
multiply
normalise --total 1
gamma --gamma 0.5
stretch --function asinh
noise --sigma 1
noise --exposure 1000 --electrons-per-unit 1 --sky-rate 1 --read-noise 5
flip
crop --box 11,4000,11,4000
pad --margin 10
bin --factor 2
resample --factor 0.7
rotate --angle 90
rotate --angle 30
convolve --psf psf.fits
convolve --psf psf.fits --precision single
stack --layout cube
rgb --bits 8
stats
photometry --radius 500
compare
OPERATIONS
