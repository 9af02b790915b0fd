#include "gamer/render/stars/star_fields.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "render/stars/star_fields.cc"
#include "hwy/foreach_target.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <utility>

#include "hwy/highway.h"

HWY_BEFORE_NAMESPACE();
namespace gamer::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void Dim(const StarFields::DistanceScale& scale, const float* HWY_RESTRICT share,
         std::span<const float> distances, const float* HWY_RESTRICT light,
         float* HWY_RESTRICT out) {
  using Scale = StarFields::DistanceScale;
  const hn::ScalableTag<float> d;
  const hn::RebindToSigned<decltype(d)> di;
  // Bits of positive floats fit signed numbers.
  const auto first = hn::Set(di, static_cast<std::int32_t>(scale.first_bits()));
  const auto last = hn::Set(di, static_cast<std::int32_t>(scale.largest_offset()));
  const auto mask = hn::Set(di, static_cast<std::int32_t>(Scale::mask));
  const auto unit = hn::Set(d, 1.0f / (Scale::mask + 1));
  for (std::size_t i = 0; i < distances.size(); i += hn::Lanes(d)) {
    const auto bits = hn::Max(hn::BitCast(di, hn::Load(d, distances.data() + i)), first);
    const auto offset = hn::Min(hn::Sub(bits, first), last);
    const auto index = hn::ShiftRight<Scale::shift>(offset);
    const auto between = hn::Mul(hn::ConvertTo(d, hn::And(offset, mask)), unit);
    const auto low = hn::GatherIndex(d, share, index);
    const auto high = hn::GatherIndex(d, share + 1, index);
    const auto value = hn::MulAdd(between, hn::Sub(high, low), low);
    hn::Store(hn::Mul(value, hn::Load(d, light + i)), d, out + i);
  }
}

}  // namespace gamer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace gamer {

HWY_EXPORT(Dim);

namespace {

// Logarithmic range of q above the limit over which stars fade in.
const double fade_width = std::log(4);

// Smallest weight of the brightest star for which stars are drawn. With smaller weights the limit
// is near the end of the luminosity function, and nearly all candidates are below it.
constexpr double least_weight = 1e-8;

// Number of samples along a ray on which stars are counted. Rays go to the galaxy's centre, and to
// four places around it within the dense part of the field.
constexpr int count_samples = 200;

// Largest number of octaves of the smooth light's distances.
constexpr int most_octaves = 24;

// Largest distance, in octaves, between spectra of the smooth light, and largest number of spectra.
// Nearer light is negligible.
constexpr double octaves_per_part = 0.75;
constexpr int most_parts = 6;
// Change of the smooth share across the galaxy below which one spectrum suffices.
constexpr double even_change = 0.05;

/// The stars along a ray, per unit solid angle (in an orthographic view: area).
struct Column {
  std::vector<double> stars;     ///< [sample] stars per steradian (scene unit^2)
  std::vector<double> distance;  ///< 1 in an orthographic view
};

/// The field's density in the plane without its arms, at most about 1.
double plain_density(const StarField& field, const glm::dvec3& place) {
  StarField::Cell cell{{place.x, place.y, place.z}, 0, 0, 0};
  return field.bound(cell);
}

Column column_towards(const PlacedGalaxy& placed, const StarField& field, const Camera& camera,
                      const glm::dvec3& target) {
  const bool is_parallel = camera.projection() == Projection::orthographic;
  const glm::dvec3 point = placed.centre + glm::inverse(placed.to_ball) * target;
  const glm::dvec3 direction = -camera.towards(point);
  const glm::dvec3 origin = is_parallel ? point : camera.origin();
  const glm::dvec3 o = placed.to_ball * (origin - placed.centre);
  const glm::dvec3 d = placed.to_ball * direction;
  const double dd = glm::dot(d, d), od = glm::dot(o, d);
  const double room = od * od - dd * (glm::dot(o, o) - 1);
  Column column;
  if (!(room > 0)) return column;
  double begin = (-od - std::sqrt(room)) / dd;
  const double end = (-od + std::sqrt(room)) / dd;
  if (!is_parallel) begin = std::max(begin, 0.0);
  if (!(end > begin)) return column;
  // Number of stars per scene unit^3 where the density is 1.
  const double density = field.density() * std::abs(glm::determinant(placed.to_ball));
  const double step = (end - begin) / count_samples;
  for (int i = 0; i < count_samples; ++i) {
    const double t = begin + (i + 0.5) * step;
    const double distance = is_parallel ? 1 : t;
    column.stars.push_back(density * plain_density(field, o + t * d) * step * distance * distance);
    column.distance.push_back(distance);
  }
  return column;
}

/// Expected number of stars above q.
double stars_above(const Column& column, const StellarPopulation& population, double q) {
  double sum = 0;
  for (std::size_t i = 0; i < column.stars.size(); ++i) {
    const double distance = column.distance[i];
    if (column.stars[i] > 0) {
      sum += column.stars[i] * population.number_above(q * distance * distance);
    }
  }
  return sum;
}

}  // namespace

StarFields::DistanceScale::DistanceScale(double nearest, double farthest) {
  const auto floor_of = [](double distance) {
    constexpr double smallest = std::numeric_limits<float>::min();
    const auto bits = std::bit_cast<std::uint32_t>(
        static_cast<float>(std::clamp(distance, smallest, 1 / smallest)));
    return bits & ~mask;
  };
  first_ = floor_of(nearest);
  const std::uint32_t end = floor_of(farthest) + mask + 1;
  largest_offset_ = end - first_ - 1;
  size_ = ((end - first_) >> shift) + 1;
}

void StarFields::Field::dim(const SmoothPart& part, std::span<const float> distances,
                            const float* light, float* out) const {
  HWY_DYNAMIC_DISPATCH(Dim)(scale, part.share.data(), distances, light, out);
}

double StarFields::Field::weight(double q) const {
  const double u = std::clamp(std::log(q / limit) / fade_width, 0.0, 1.0);
  return u * u * (3 - 2 * u);
}

StarFields::StarFields(const Scene& scene, const Camera& camera, double stars_per_pixel)
    : is_parallel_(camera.projection() == Projection::orthographic) {
  for (std::size_t g = 0; g < scene.galaxies.size(); ++g) {
    const PlacedGalaxy& placed = scene.galaxies[g];
    const auto components = placed.galaxy->components();
    for (std::size_t c = 0; c < components.size(); ++c) {
      const StarField* stars = components[c]->star_field();
      if (stars == nullptr) continue;
      Field field{static_cast<int>(g), c, stars, std::numeric_limits<double>::infinity(), {}, {}};
      // A component that is hidden while another one is shown alone has no amplitude.
      const bool is_shown = std::as_const(*components[c]).amplitude() > 0;
      if (placed.draws_stars && is_shown && stars_per_pixel > 0)
        set_limit(scene, camera, stars_per_pixel, field);
      // All threads together make the clumps here. While drawing, one thread would make them and
      // the others would wait.
      if (!std::isinf(field.limit)) stars->clumps();
      if (std::isinf(field.limit)) {
        field.parts = {{std::shared_ptr<const Sed>(placed.galaxy, stars->sed()), {}}};
      } else if (is_parallel_) {
        set_parts(1, 1, field);
      } else {
        const double distance = camera.distance(placed.centre);
        set_parts(distance - placed.bounding_radius, distance + placed.bounding_radius, field);
      }
      fields_.push_back(std::move(field));
    }
  }
}

void StarFields::set_limit(const Scene& scene, const Camera& camera, double stars_per_pixel,
                           Field& field) {
  const PlacedGalaxy& placed = scene.galaxies[static_cast<std::size_t>(field.galaxy)];
  const StellarPopulation& population = field.stars->population();
  const LayerShape& shape = field.stars->shape();
  const double r = std::max({shape.rh, shape.inner, shape.radial.ring_radius});
  std::vector<Column> columns;
  double nearest = HUGE_VAL, farthest = 0;
  for (const glm::dvec3& target : {glm::dvec3(0), glm::dvec3(r, 0, 0), glm::dvec3(-r, 0, 0),
                                   glm::dvec3(0, r, 0), glm::dvec3(0, -r, 0)}) {
    Column column = column_towards(placed, *field.stars, camera, target);
    // Solid angle or area of a pixel.
    const glm::dvec3 point = placed.centre + glm::inverse(placed.to_ball) * target;
    double pixel = camera.pixel_size(point);
    if (!is_parallel_) {
      const double distance = camera.distance(point);
      if (!(distance > 0)) continue;
      pixel /= distance;
    }
    for (double& stars : column.stars) stars *= pixel * pixel;
    for (const double distance : column.distance) {
      nearest = std::min(nearest, distance);
      farthest = std::max(farthest, distance);
    }
    columns.push_back(std::move(column));
  }
  if (!(farthest > 0)) return;
  const auto expected = [&](double q) {
    double most = 0;
    for (const Column& column : columns) most = std::max(most, stars_above(column, population, q));
    return most;
  };
  // Bisection in ln q, between a limit that all stars exceed and a limit that no star exceeds.
  double low = std::log(population.at(0).low / (farthest * farthest));
  double high = std::log(population.at(population.size() - 1).high / (nearest * nearest));
  if (expected(std::exp(low)) <= stars_per_pixel) {
    field.limit = std::exp(low - fade_width);
    return;
  }
  constexpr int halvings = 40;
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (low + high);
    (expected(std::exp(middle)) > stars_per_pixel ? low : high) = middle;
  }
  field.limit = std::exp(high);
  const double brightest = population.at(population.size() - 1).high / (nearest * nearest);
  if (field.weight(brightest) < least_weight) field.limit = std::numeric_limits<double>::infinity();
}

void StarFields::set_parts(double nearest, double farthest, Field& field) const {
  const StellarPopulation& population = field.stars->population();
  const auto rest_at = [&](double distance, std::vector<double>* spectrum) {
    return population.light(
        [&](double luminosity) { return 1 - field.weight(luminosity / (distance * distance)); },
        spectrum);
  };
  const double last = std::log2(farthest);
  const double octaves =
      std::min(last - std::log2(std::max(nearest, 1e-300)), double{most_octaves});
  const double change = rest_at(farthest, nullptr) - rest_at(std::exp2(last - octaves), nullptr);
  const bool is_even = is_parallel_ || change < even_change;
  const int parts =
      is_even ? 1
              : std::min(static_cast<int>(std::ceil(octaves / octaves_per_part)) + 1, most_parts);
  const double spacing = parts > 1 ? std::min(octaves / (parts - 1), octaves_per_part) : 1;
  field.scale = DistanceScale(std::exp2(last - octaves), farthest);
  std::vector<double> logs, rest;
  for (std::size_t i = 0; i < field.scale.size(); ++i) {
    const double distance = field.scale.at(i);
    logs.push_back(std::log2(distance));
    rest.push_back(rest_at(distance, nullptr));
  }
  for (int b = 0; b < parts; ++b) {
    const double level = is_even ? last - 0.5 * octaves : last - b * spacing;
    SmoothPart part;
    if (field.stars->has_one_sed()) {
      part.sed = std::shared_ptr<const Sed>(std::shared_ptr<const Sed>(), field.stars->sed());
    } else {
      std::vector<double> spectrum;
      rest_at(std::exp2(level), &spectrum);
      part.sed = field.stars->spectrum(population.sed(spectrum));
    }
    for (std::size_t i = 0; i < logs.size(); ++i) {
      double blend = std::max(1 - std::abs(logs[i] - level) / spacing, 0.0);
      if (parts == 1 || (b == parts - 1 && logs[i] < level)) blend = 1;
      if (b == 0 && logs[i] > level) blend = 1;  // the scale extends beyond the farthest part
      part.share.push_back(static_cast<float>(blend * rest[i]));
    }
    field.parts.push_back(std::move(part));
  }
}

const StarFields::Field* StarFields::find(int galaxy, std::size_t component) const {
  const auto key = [](const Field& field) { return std::pair(field.galaxy, field.component); };
  const auto at =
      std::lower_bound(fields_.begin(), fields_.end(), std::pair(galaxy, component),
                       [&](const Field& field, const auto& wanted) { return key(field) < wanted; });
  return at == fields_.end() || key(*at) != std::pair(galaxy, component) ? nullptr : &*at;
}

}  // namespace gamer
#endif
