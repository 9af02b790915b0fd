#!/usr/bin/env bash
# Prints scenes/deepfield_2014.lst: 2000 galaxies of all shipped types, at random positions in a box
# of 1600 x 1600 x 1600 units, with random orientations, radii of 5 to 60 units, and four seeds.
# Usage: scripts/deepfield.sh > scenes/deepfield_2014.lst
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

types=(dusty_barred elliptical elliptical_dust flocculent irregular ngc1300 ngc4321 ngc4594 ngc891
  one_armed spiral)
echo "# made by scripts/deepfield.sh"
awk -v types="${types[*]}" '
  # Park and Miller 1988: the same everywhere, unlike rand().
  function uniform() { state = (state * 48271) % 2147483647; return state / 2147483647 }
  BEGIN {
    state = 2014
    count = split(types, type, " ")
    print "galaxy           x        y        z        ox      oy      oz      size   seed"
    for (i = 0; i < 2000; ++i) {
      cosine = 2 * uniform() - 1
      angle = 2 * 3.14159265358979 * uniform()
      sine = sqrt(1 - cosine * cosine)
      printf "%-15s  %7.2f  %7.2f  %7.2f  %6.3f  %6.3f  %6.3f  %5.2f  %d\n",
        type[1 + int(count * uniform())], 1600 * uniform() - 800, 1600 * uniform() - 800,
        1600 * uniform() - 800, sine * cos(angle), sine * sin(angle), cosine,
        5 + 55 * uniform(), 1 + int(4 * uniform())
    }
  }'
