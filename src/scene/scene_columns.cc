#include "gamer/scene/scene_columns.h"
#include "gamer/core/random.h"

namespace gamer {
namespace {

constexpr double full_circle = 360;
// Between these sizes, path lengths and densities stay within single precision.
constexpr double smallest_size = 1e-15;
constexpr double largest_size = 1e15;
// Bounds of magnitudes, beyond those of any real object. At usual distances pixels can hold all
// fluxes within them.
constexpr double brightest_magnitude = -60;
constexpr double faintest_magnitude = 100;
constexpr double largest_redshift = 1000;
// Mpc; the Sun is at 5e-12 Mpc.
constexpr double smallest_distance = 1e-12;
constexpr double largest_distance = 1e6;

constexpr const char* scene_unit = "scene units";

ParameterTable place_columns() {
  const Interval any = Interval::any();
  return {
      required(Parameter::text(
          "galaxy", std::nullopt,
          "name or file of its type in `galaxies/`; `star` is a point source; `sersic`, "
          "`exponential`, `devaucouleurs` and `bulge+disk` are made from the row")),
      Parameter::number("x", scene_unit, any, std::nullopt,
                        "position of its centre, x; not in a sky view"),
      Parameter::number("y", scene_unit, any, std::nullopt, "position of its centre, y"),
      Parameter::number("z", scene_unit, any, std::nullopt, "position of its centre, z"),
      Parameter::number("ra", "deg", any, std::nullopt,
                        "right ascension; in a sky view, as the next ones"),
      Parameter::number("dec", "deg", Interval::closed(-90, 90), std::nullopt, "declination"),
      Parameter::number("dx", "arcsec", any, std::nullopt,
                        "instead of `ra dec`: offset from the image's middle to the East"),
      Parameter::number("dy", "arcsec", any, std::nullopt,
                        "instead of `ra dec`: offset from the image's middle to the North"),
      Parameter::number("px", "pixels", any, std::nullopt,
                        "instead of `ra dec`: FITS pixel, from 1"),
      Parameter::number("py", "pixels", any, std::nullopt, "instead of `ra dec`: FITS pixel, y"),
  };
}

ParameterTable orientation_columns() {
  const Interval any = Interval::any();
  return {
      Parameter::number(
          "ox", "", any, 0.0,
          "direction of its +z axis in the scene (of any length), x; not in a sky view"),
      Parameter::number("oy", "", any, 0.0, "direction of its +z axis, y"),
      Parameter::number("oz", "", any, 1.0, "direction of its +z axis, z"),
      Parameter::number("inclination", "deg", Interval::closed(-full_circle, full_circle),
                        std::nullopt,
                        "instead of `ox oy oz`: 0 is face-on to the camera (in a film to the "
                        "camera of the first frame); default 0 in a sky view"),
      Parameter::number("axis_ratio", "", Interval::left_open(0, 1), std::nullopt,
                        "instead of `inclination`: minor over major axis on the sky, by second "
                        "moments of the light without dust"),
      Parameter::number(
          "pa", "deg", any, 0.0,
          "rotation about its own axis; with `inclination` and in a sky view the position angle of "
          "the line of nodes, from the image's +y towards -x (on the sky East of North)"),
  };
}

ParameterTable shape_columns() {
  const Interval sizes = Interval::closed(smallest_size, largest_size);
  return {
      Parameter::number("size", scene_unit, sizes, 1.0,
                        "radius of the ball that holds it; not in a sky view"),
      Parameter::number("size_kpc", "kpc", sizes, std::nullopt,
                        "radius of the ball that holds it; in a sky view"),
      Parameter::number("size_arcsec", "arcsec", sizes, std::nullopt,
                        "instead of `size_kpc`: the ball's radius on the sky"),
      Parameter::number("half_light_radius", "arcsec", sizes, std::nullopt,
                        "instead of `size_kpc`: half-light radius along the major axis, without "
                        "dust, in photometry.reference_band"),
      Parameter::number("half_light_radius_kpc", "kpc", sizes, std::nullopt,
                        "instead of `half_light_radius`: the half-light radius as a length"),
      Parameter::number(
          "sersic_index", "", Interval::closed(0.5, 10), std::nullopt,
          "n of a galaxy `sersic`; of the bulge of `bulge+disk` (there 4 by default)"),
      Parameter::number(
          "bulge_fraction", "", Interval::closed(0, 1), std::nullopt,
          "share of the bulge in the light of a galaxy `bulge+disk`, at 5500 Angstrom at rest"),
      Parameter::number("bulge_radius_ratio", "", Interval::closed(0.01, 10), std::nullopt,
                        "half-light radius of the bulge of `bulge+disk` over that of its disk; by "
                        "default 0.12"),
  };
}

ParameterTable light_columns() {
  const Interval magnitudes = Interval::closed(brightest_magnitude, faintest_magnitude);
  return {
      Parameter::number("magnitude", "mag", magnitudes, std::nullopt,
                        "absolute AB magnitude in photometry.reference_band"),
      Parameter::number(
          "apparent_magnitude", "mag", magnitudes, std::nullopt,
          "instead of `magnitude`: apparent AB magnitude in photometry.reference_band"),
      Parameter::number(
          "redshift", "", Interval::closed(0, largest_redshift), 0.0,
          "redshift, which shifts and dims the light; in a sky view also gives the distance"),
      Parameter::number("distance", "Mpc", Interval::closed(smallest_distance, largest_distance),
                        std::nullopt,
                        "luminosity distance, instead of the distance from `redshift`"),
      Parameter::number("g1", "", Interval::open(-1, 1), 0.0,
                        "reduced shear: stretches a galaxy's image along North (the image's +y)"),
      Parameter::number("g2", "", Interval::open(-1, 1), 0.0,
                        "reduced shear: stretches a galaxy's image along position angle 45 deg"),
      Parameter::number("kappa", "", Interval::right_open(-10, 1), 0.0,
                        "convergence: with the shear it magnifies image and flux"),
  };
}

ParameterTable spectrum_columns() {
  return {
      Parameter::text("sed", std::nullopt,
                      "spectrum of a star (default `flat_fnu`), or of all components of a galaxy"),
      Parameter::text(
          "overrides", std::nullopt,
          "parameters that differ from the type's file, as `arms.count=4;dust.optical_depth=3`; "
          "columns called `arms.count`, `dust.optical_depth`... add to them"),
      Parameter::integer("seed", "", Interval::closed(0, largest_seed), 1,
                         "seed of the galaxy; another number makes another galaxy of its type"),
      Parameter::text("id", std::nullopt, "label for readers"),
  };
}

}  // namespace

const ParameterTable& scene_columns() {
  static const ParameterTable columns = place_columns() + orientation_columns() + shape_columns() +
                                        light_columns() + spectrum_columns();
  return columns;
}

}  // namespace gamer
