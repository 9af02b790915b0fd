#!/usr/bin/env bash
# Prints scenes/survey_field.lst: 300 galaxies of ten shipped types in a field of 2 x 2 arcmin, of
# radii from 1 to 6 arcsec, seen from all sides, each with a seed of its own.
# Usage: scripts/survey-field.sh > scenes/survey_field.lst
set -euo pipefail

types=(dusty_barred elliptical elliptical_dust flocculent irregular m51 ngc1300 ngc4321 one_armed
  spiral)
echo "# made by scripts/survey-field.sh"
awk -v types="${types[*]}" '
  # Park and Miller 1988: the same everywhere, unlike rand().
  function uniform() { state = (state * 48271) % 2147483647; return state / 2147483647 }
  BEGIN {
    state = 300
    count = split(types, type, " ")
    degree = 180 / 3.14159265358979
    print "galaxy           dx      dy      redshift  size_arcsec  apparent_magnitude  inclination  pa     seed"
    for (i = 1; i <= 300; ++i) {
      cosine = uniform()
      inclination = degree * atan2(sqrt(1 - cosine * cosine), cosine)
      size = exp(log(6) * uniform())
      printf "%-15s  %6.2f  %6.2f  %8.3f  %11.3f  %18.2f  %11.1f  %5.1f  %d\n",
        type[1 + (i - 1) % count], 116 * uniform() - 58, 116 * uniform() - 58,
        0.05 + 0.45 * uniform(), size, 23.5 - 2.5 * log(size) / log(10) + uniform() - 0.5,
        inclination, 360 * uniform(), i
    }
  }'
