#include "gamer/scene/scene_columns.h"
#include "gamer/core/random.h"

namespace gamer {
namespace {

using Type = ParameterType;

constexpr double full_turn = 360;
// Between these sizes, path lengths and densities stay within single precision.
constexpr double smallest_size = 1e-15;
constexpr double largest_size = 1e15;
// Nothing is brighter or fainter. At usual distances pixels hold the fluxes between these
// magnitudes.
constexpr double brightest_magnitude = -60;
constexpr double faintest_magnitude = 100;
constexpr double largest_redshift = 1000;
// Mpc; the Sun is at 5e-12 Mpc.
constexpr double smallest_distance = 1e-12;
constexpr double largest_distance = 1e6;

ParameterTable make_columns() {
  const Interval any = Interval::any();
  const Interval sizes = Interval::closed(smallest_size, largest_size);
  const Interval magnitudes = Interval::closed(brightest_magnitude, faintest_magnitude);
  const std::string unit = "scene units";
  return {
      {"galaxy",
       Type::text,
       "",
       any,
       {},
       "name or file of its type in `galaxies/`; `star` is a point source",
       {},
       true},
      {"x", Type::number, unit, any, {}, "position of its centre, x; not in a sky view"},
      {"y", Type::number, unit, any, {}, "the same, y"},
      {"z", Type::number, unit, any, {}, "the same, z"},
      {"ra", Type::number, "deg", any, {}, "right ascension; in a sky view, as the next ones"},
      {"dec", Type::number, "deg", Interval::closed(-90, 90), {}, "declination"},
      {"dx",
       Type::number,
       "arcsec",
       any,
       {},
       "instead of `ra dec`: offset from the image's middle to the East"},
      {"dy", Type::number, "arcsec", any, {}, "the same, to the North"},
      {"px", Type::number, "pixels", any, {}, "instead of `ra dec`: FITS pixel, from 1"},
      {"py", Type::number, "pixels", any, {}, "the same, y"},
      {"ox", Type::number, "", any, 0.0,
       "direction of its +z axis in the scene (of any length), x; not in a sky view"},
      {"oy", Type::number, "", any, 0.0, "the same, y"},
      {"oz", Type::number, "", any, 1.0, "the same, z"},
      {"inclination",
       Type::number,
       "deg",
       Interval::closed(-full_turn, full_turn),
       {},
       "instead of `ox oy oz`: 0 is face-on to the camera, of a film to that of its first frame; "
       "in "
       "a sky view 0 unless given"},
      {"pa", Type::number, "deg", any, 0.0,
       "turn about its own axis; with `inclination` and in a sky view: of the node, from the "
       "image's +y towards -x, on the sky East of North"},
      {"size", Type::number, unit, sizes, 1.0, "radius; not in a sky view"},
      {"size_kpc", Type::number, "kpc", sizes, {}, "radius; in a sky view"},
      {"size_arcsec", Type::number, "arcsec", sizes, {}, "radius; in a sky view, instead"},
      {"magnitude",
       Type::number,
       "mag",
       magnitudes,
       {},
       "absolute AB magnitude in photometry.reference_band"},
      {"apparent_magnitude",
       Type::number,
       "mag",
       magnitudes,
       {},
       "instead: apparent AB magnitude in photometry.reference_band"},
      {"redshift", Type::number, "", Interval::closed(0, largest_redshift), 0.0,
       "shifts and dims the light and, in a sky view, gives the distance"},
      {"distance",
       Type::number,
       "Mpc",
       Interval::closed(smallest_distance, largest_distance),
       {},
       "luminosity distance, where the redshift does not tell it"},
      {"sed",
       Type::text,
       "",
       any,
       {},
       "of a star (default `flat_fnu`); for a galaxy, instead of those of its components"},
      {"seed", Type::integer, "", Interval::closed(0, largest_seed), std::int64_t{1},
       "another number makes another galaxy of the same type"},
      {"id", Type::text, "", any, {}, "a name for people"},
  };
}

}  // namespace

const ParameterTable& scene_columns() {
  static const ParameterTable columns = make_columns();
  return columns;
}

}  // namespace gamer
