#include "scene/field_stars.h"

#include <algorithm>
#include <cmath>
#include <glm/trigonometric.hpp>
#include <numbers>

#include "gamer/core/random.h"
#include "gamer/core/random_variate.h"
#include "gamer/scene/camera.h"

namespace gamer {
namespace {

constexpr int band_count = 720;
constexpr double band_height = 180.0 / band_count;  // deg

}  // namespace

double magnitude_at(double bright, double faint, double slope, double u) {
  const double range = faint - bright;
  return bright + range * exponential_quantile(std::numbers::ln10 * slope * range, u);
}

double field_temperature(const FieldStarParameters& parameters, int i) {
  const double share = static_cast<double>(i) / (field_temperatures - 1);
  return parameters.coldest * std::pow(parameters.hottest / parameters.coldest, share);
}

void visit_field_stars(const FieldStarParameters& parameters,
                       const std::function<bool(const glm::dvec3& direction, double radius)>& holds,
                       const std::function<void(const FieldStar& star)>& take) {
  if (!(parameters.number > 0)) return;
  // Half a cell's diagonal.
  const double radius = glm::radians(band_height) * 0.5 * std::numbers::sqrt2;
  for (int band = 0; band < band_count; ++band) {
    const double south = -90 + band * band_height, north = south + band_height;
    const double widest = std::max(std::cos(glm::radians(south)), std::cos(glm::radians(north)));
    const int cells = std::max(static_cast<int>(std::ceil(360 * widest / band_height)), 1);
    const double low = std::sin(glm::radians(south)), high = std::sin(glm::radians(north));
    const double square_degrees = 360.0 / cells * glm::degrees(high - low);
    for (int cell = 0; cell < cells; ++cell) {
      const double west = 360.0 * cell / cells, width = 360.0 / cells;
      if (!holds(direction_of({west + 0.5 * width, 0.5 * (south + north)}), radius)) continue;
      const std::uint64_t key = hash_words(
          {parameters.seed, static_cast<std::uint64_t>(band), static_cast<std::uint64_t>(cell)});
      double count = parameters.number * square_degrees;
      poisson_variates(key, 0, std::span(&count, 1), std::span(&count, 1));
      for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(count); ++i) {
        const std::uint64_t star_key = mix64(key + (i + 1) * golden_gamma);
        const auto u = [&](std::uint64_t k) { return to_unit(mix64(star_key + k * golden_gamma)); };
        const double sine = low + (high - low) * u(1);
        const auto temperature = static_cast<int>(u(4) * field_temperatures);
        take({direction_of({west + width * u(2), glm::degrees(std::asin(sine))}),
              magnitude_at(parameters.bright, parameters.faint, parameters.slope, u(3)),
              field_temperature(parameters, temperature)});
      }
    }
  }
}

}  // namespace gamer
