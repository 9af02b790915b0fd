#include "gamer/scene/background.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <string_view>

#include "core/message.h"
#include "gamer/core/random.h"
#include "gamer/core/random_variate.h"
#include "gamer/core/units.h"
#include "scene/field_stars.h"

namespace gamer {
namespace {

// Counts of galaxies (LSST Science Book 2009, section 3.7).
constexpr double count_at_25 = 46;  // arcmin^-2
constexpr double count_slope = 0.31;
constexpr double star_slope = 0.2;
// Sizes: 0.3 to 0.6 arcsec at i = 22 to 24.
constexpr double radius_at_23 = 0.45;  // arcsec
constexpr double radius_slope = -0.08;
constexpr double radius_deviation = 0.18;  // dex
// Colours of most stars fainter than magnitude 14 at high latitudes: B - V from 1.6 to 0.4, by T of
// B - V (Ballesteros 2012, EPL 97, 34008).
constexpr double coldest = 3700, hottest = 6900;  // K

// Shipped types by class, and the share of each class.
constexpr std::string_view early[] = {"elliptical", "lenticular", "elliptical"};
constexpr std::string_view sbc[] = {"ngc4321", "ngc1300", "ngc4414", "m51", "ngc1097", "m83"};
constexpr std::string_view scd[] = {"flocculent", "ngc7793", "m33", "m101", "m74"};
constexpr std::string_view irregular[] = {"irregular", "lmc"};
struct TypeShare {
  std::span<const std::string_view> types;
  double share;
};
constexpr TypeShare type_shares[] = {{early, 0.2}, {sbc, 0.24}, {scd, 0.32}, {irregular, 0.24}};

constexpr double arcminute = 60 * arcsecond;

/// The random numbers of one object: uniform in [0, 1), one for each purpose.
class Draws {
 public:
  Draws(std::uint64_t key, std::uint64_t object) : key_(hash_words({key, object})) {}
  double uniform() { return to_unit(mix64(key_ + ++used_ * golden_gamma)); }
  double normal() {
    double value = 0;
    normal_variates(key_, ++used_, std::span(&value, 1));
    return value;
  }
  std::uint64_t word() { return mix64(key_ + ++used_ * golden_gamma); }

 private:
  std::uint64_t key_;
  std::uint64_t used_ = 0;
};

std::string_view type_at(double u, double v) {
  for (const TypeShare& type_share : type_shares) {
    if (u < type_share.share || &type_share == std::end(type_shares) - 1) {
      return type_share
          .types[static_cast<std::size_t>(v * static_cast<double>(type_share.types.size()))];
    }
    u -= type_share.share;
  }
  return early[0];
}

/// The part of the sky that an image shows.
class View {
 public:
  explicit View(const Camera& camera) : camera_(camera) {
    // A coarse grid suffices, since the solid angle of pixels varies slowly.
    constexpr int most_places = 64;
    const int columns = std::min(camera.width(), most_places);
    const int rows = std::min(camera.height(), most_places);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const double x = at((i + 0.5) / columns, camera.width());
        const double y = at((j + 0.5) / rows, camera.height());
        largest_ = std::max(largest_, camera.solid_angle(x, y));
      }
    }
  }

  /// The area of the image in square arcminutes if all pixels were as large as the largest.
  double area() const {
    return largest_ * camera_.width() * camera_.height() / (arcminute * arcminute);
  }
  /// The position of an object in a random pixel. It is empty with a probability of 1 - s, where s
  /// is the pixel's solid angle over the largest one. Pixels without sky have no position.
  std::optional<SkyPosition> position(Draws& draws) const {
    const double x = at(draws.uniform(), camera_.width());
    const double y = at(draws.uniform(), camera_.height());
    const double kept = draws.uniform();
    const std::optional<Ray> ray = camera_.ray(x, y);
    if (!ray || kept * largest_ >= camera_.solid_angle(x, y)) return std::nullopt;
    return sky_of(ray->direction);
  }

 private:
  static double at(double share, int pixels) { return share * pixels - 0.5; }

  const Camera& camera_;
  double largest_ = 0;  ///< pixel, sr
};

std::uint64_t count(std::uint64_t key, double mean) {
  poisson_variates(key, 0, std::span(&mean, 1), std::span(&mean, 1));
  return static_cast<std::uint64_t>(mean);
}

std::string galaxy_row(const SkyPosition& at, const Background& background, Draws& draws) {
  const double magnitude =
      magnitude_at(background.brightest, background.faintest, count_slope, draws.uniform());
  // The sum of three exponential variates has the density z^2 exp(-z).
  double product = 1;
  for (int k = 0; k < 3; ++k) product *= 1 - draws.uniform();
  constexpr double least_redshift = 1e-3;
  const double redshift =
      std::max(-Background::redshift_scale(magnitude) * std::log(product), least_redshift);
  const double radius =
      Background::half_light_radius(magnitude) * std::pow(10, radius_deviation * draws.normal());
  const double class_at = draws.uniform(), type_in_class = draws.uniform();
  const std::string_view type = type_at(class_at, type_in_class);
  const double inclination = std::acos(draws.uniform()) * 180 / std::numbers::pi;
  const double pa = 180 * draws.uniform();
  return fmt::format("{} {:.6f} {:.6f} {:.4f} {:.3f} {:.3f} {:.1f} {:.1f} - {}\n", type, at.ra,
                     at.dec, redshift, radius, magnitude, inclination, pa, draws.word() >> 33);
}

std::string star_row(const SkyPosition& at, Draws& draws) {
  const double magnitude = magnitude_at(Background::brightest_star, Background::faintest_star,
                                        star_slope, draws.uniform());
  // Temperatures are rounded, so that all stars share few spectra.
  constexpr double step = 250;
  const double temperature =
      step * std::round(coldest / step * std::pow(hottest / coldest, draws.uniform()));
  return fmt::format("star {:.6f} {:.6f} - - {:.3f} - - blackbody({:.0f}K) -\n", at.ra, at.dec,
                     magnitude, temperature);
}

}  // namespace

double Background::galaxies_brighter(double i) {
  return count_at_25 * std::pow(10, count_slope * (i - 25));
}

double Background::half_light_radius(double i) {
  return radius_at_23 * std::pow(10, radius_slope * (i - 23));
}

double Background::redshift_scale(double i) { return 0.0417 * i - 0.744; }

std::string background_list(const Background& background, const Camera& camera) {
  if (camera.projection() != Projection::sky) {
    throw InputError("gamer: background needs a parameter file with camera.projection = \"sky\"");
  }
  const View view(camera);
  const double galaxies = view.area() * (Background::galaxies_brighter(background.faintest) -
                                         Background::galaxies_brighter(background.brightest));
  const double stars = view.area() * background.star_number;
  if (galaxies + stars > Background::most_objects) {
    throw input_error(
        "gamer: the background would have {:.3g} objects, more than {:.0f}; a smaller view or "
        "a brighter limit of galaxies has fewer",
        galaxies + stars, Background::most_objects);
  }
  std::string list =
      "galaxy ra dec redshift half_light_radius apparent_magnitude inclination pa sed seed\n";
  const auto add = [&](std::string_view purpose, double mean, const auto& row) {
    const std::uint64_t key = hash_text(background.seed, purpose);
    const std::uint64_t objects = count(key, mean);
    for (std::uint64_t k = 0; k < objects; ++k) {
      Draws draws(key, k);
      if (const auto at = view.position(draws)) list += row(*at, draws);
    }
  };
  add("background galaxies", galaxies,
      [&](const SkyPosition& at, Draws& draws) { return galaxy_row(at, background, draws); });
  add("background stars", stars, star_row);
  return list;
}

}  // namespace gamer
