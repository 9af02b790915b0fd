#include "gamer/scene/star_settings.h"

#include "core/message.h"
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

}  // namespace

ParameterSection StarSettings::section() {
  return {
      "stars",
      "Field stars over the whole sky, besides those of the scene, and the drawing of stars.",
      {Parameter::number("number", "1/deg^2", Interval::closed(0, most_field_stars), 0.0,
                         "number of field stars between the magnitudes (sky views)"),
       Parameter::number("bright", "mag", Interval::any(), 14.0,
                         "AB magnitude of the brightest field stars in photometry.reference_band"),
       Parameter::number("faint", "mag", Interval::any(), 24.0,
                         "AB magnitude of the faintest field stars"),
       Parameter::number("slope", "dex/mag", Interval::closed(-2, 2), 0.2,
                         "slope of the counts: dN/dm ~ 10^(slope m)"),
       Parameter::number("temperature_low", "K", star_temperatures(), 3000.0,
                         "lowest temperature; stars are blackbodies, uniform in ln T"),
       Parameter::number("temperature_high", "K", star_temperatures(), 9000.0,
                         "highest temperature"),
       Parameter::integer("seed", "", Interval::closed(0, largest_seed), 1,
                          "seed of the field stars"),
       Parameter::boolean("antialiased", true,
                          "share a star's light among the four nearest pixels, so that its "
                          "centroid is exact; false puts it into one pixel"),
       Parameter::boolean("discs", std::nullopt,
                          "draw stars whose pixel would be brighter than the white point as white "
                          "discs of that brightness, in a halo of their colour; by default true "
                          "for pictures (.png, .bmp) and with white_point"),
       Parameter::number("white_point", "", Interval::positive(), std::nullopt,
                         "brightness of the discs in the image's unit; by default the white of the "
                         "picture that the image makes"),
       Parameter::number(
           "largest_radius", "pixels", Interval::closed(1, largest_star_radius), 8.0,
           "largest radius of these discs; stars that need larger discs become brighter ones"),
       Parameter::number(
           "halo", "", Interval::right_open(0, 1), 0.6,
           "about the share of a bright star's light beyond the radius of its white "
           "core; the halo falls with the distance d as d^(-2/halo), and 0 is a disc"),
       Parameter::number("spikes", "", Interval::right_open(0, 1), 0.0,
                         "share of a bright star's light in four diffraction spikes"),
       Parameter::boolean("table", false,
                          "add table STARS to a FITS image: places, magnitudes, distances and "
                          "optical depths of the stars of star fields that it draws")},
      {}};
}

double StarSettings::reach() const {
  return largest_radius * (halo > 0 || spikes > 0 ? star_halo_radii : 1) + 1;
}

StarSettings StarSettings::read(const ParameterSet& values) {
  StarSettings result;
  result.field = {.number = values.number("number"),
                  .bright = values.number("bright"),
                  .faint = values.number("faint"),
                  .slope = values.number("slope"),
                  .coldest = values.number("temperature_low"),
                  .hottest = values.number("temperature_high"),
                  .seed = static_cast<std::uint64_t>(values.integer("seed")),
                  .number_where = values.where("number")};
  if (result.field.number > 0) check_field_stars(values);
  result.antialiased = values.boolean("antialiased");
  result.discs = optional_boolean(values, "discs");
  result.white_point = optional_number(values, "white_point");
  result.largest_radius = values.number("largest_radius");
  result.halo = values.number("halo");
  result.spikes = values.number("spikes");
  result.table = values.boolean("table");
  return result;
}

}  // namespace gamer
