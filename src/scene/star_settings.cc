#include "gamer/scene/star_settings.h"

#include "core/message.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/random.h"
#include "scene/section_values.h"

namespace gamer {
namespace {

constexpr double most_field_stars = 1e8;
constexpr double largest_star_radius = 64;

Interval star_temperatures() { return Interval::closed(1000, 1e5); }

void check_field_stars(const ParameterSet& stars) {
  const auto check_order = [&](const char* low, const char* high) {
    if (stars.number(low) < stars.number(high)) return;
    throw input_error(place_of(stars, {high, low}), "stars.{} = {} is not above stars.{} = {}",
                      high, stars.number(high), low, stars.number(low));
  };
  check_order("bright", "faint");
  check_order("temperature_low", "temperature_high");
}

BoundTable star_keys(StarSettings& p) {
  return {
      {p.field.number, "number", "1/deg^2", Interval::closed(0, most_field_stars),
       "number of field stars between the magnitudes (sky views)"},
      {p.field.bright, "bright", "mag", Interval::any(),
       "AB magnitude of the brightest field stars in photometry.reference_band"},
      {p.field.faint, "faint", "mag", Interval::any(), "AB magnitude of the faintest field stars"},
      {p.field.slope, "slope", "dex/mag", Interval::closed(-2, 2),
       "slope of the counts: dN/dm ~ 10^(slope m)"},
      {p.field.coldest, "temperature_low", "K", star_temperatures(),
       "lowest temperature; stars are blackbodies, uniform in ln T"},
      {p.field.hottest, "temperature_high", "K", star_temperatures(), "highest temperature"},
      {p.field.seed, "seed", "", Interval::closed(0, largest_seed), "seed of the field stars"},
      {p.antialiased, "antialiased",
       "share a star's light among the four nearest pixels, so that its "
       "centroid is exact; false puts it into one pixel"},
      {p.discs, "discs",
       "draw stars whose pixel would be brighter than the white point as white "
       "discs of that brightness, in a halo of their colour; by default true "
       "for pictures (.png, .bmp) without image.seeing, and with white_point"},
      {p.white_point, "white_point", "", Interval::positive(),
       "brightness of the discs in the image's unit; by default the white of the "
       "picture that the image makes"},
      {p.largest_radius, "largest_radius", "pixels", Interval::closed(1, largest_star_radius),
       "largest radius of a disc; brighter stars have brighter discs of this radius"},
      {p.halo, "halo", "", Interval::right_open(0, 1),
       "about the share of a bright star's light beyond the radius of its white "
       "core; the halo falls with the distance d as d^(-2/halo), and 0 is a disc"},
      {p.spikes, "spikes", "", Interval::right_open(0, 1),
       "share of a bright star's light in four diffraction spikes; with image.seeing that of all "
       "light"},
      {p.table, "table",
       "add table STARS to a FITS image: places, magnitudes, distances and "
       "optical depths of the stars of star fields that it draws"}};
}

}  // namespace

ParameterSection StarSettings::section() {
  return {"stars",
          "Field stars over the whole sky, besides those of the scene, and the drawing of stars.",
          declarations(star_keys)};
}

double StarSettings::reach() const {
  return largest_radius * (halo > 0 || spikes > 0 ? star_halo_radii : 1) + 1;
}

StarSettings StarSettings::read(const ParameterSet& values) {
  StarSettings result = read_object(values, star_keys);
  result.field.number_where = values.where("number");
  if (result.field.number > 0) check_field_stars(values);
  return result;
}

}  // namespace gamer
