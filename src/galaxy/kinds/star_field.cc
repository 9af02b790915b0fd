#include "gamer/galaxy/kinds/star_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "galaxy/associations/association_clumps.h"
#include "galaxy/associations/association_mean.h"
#include "galaxy/associations/association_texture.h"

namespace gamer {
namespace {

constexpr double largest_number = 1e15;

/// Whether a key or the file of luminosities gives temperatures.
bool gives_temperatures(const ParameterSet& values, const StellarPopulation& population) {
  return population.has_temperatures() || values.is_given("temperature") ||
         values.is_given("temperature_slope") || values.is_given("temperature_scatter");
}

}  // namespace

StarField::StarField(const LayerShape& shape, const ArmPattern& arms, StellarPopulation population,
                     double number, bool has_colours, std::uint64_t seed, const StarField* twin)
    : Layer(shape, arms),
      population_(std::move(population)),
      number_(number),
      seed_(seed),
      has_colours_(has_colours),
      mean_sed_(twin != nullptr ? twin->mean_sed_ : population_.sed()),
      colours_(twin != nullptr ? twin->colours_ : StarColours(mean_sed_)),
      envelope_integral_(twin != nullptr ? twin->envelope_integral_ : Layer::envelope_integral()) {
  sed_ = mean_sed_;
}

bool StarField::gather_in_clumps(const Component& associations) {
  const auto* const whole = dynamic_cast<const AssociationTexture*>(associations.texture());
  if (whole == nullptr || texture_ != nullptr) return false;
  for (const ClumpTier& tier : whole->tiers()) {
    if (cells_of(tier) <= StarClumps::most_cells) continue;
    throw InputError(follows_where(), "component '" + name() + "': follows '" + follows() +
                                          "', whose smallest clumps are too small to hold stars; "
                                          "raise its `largest` or lower its `luminosity_range`");
  }
  texture_ = AssociationTexture::of_clumps(*whole);
  is_in_clumps_ = true;
  shares_layer_ = static_cast<const Layer&>(associations).shape() == shape();
  return true;
}

std::vector<double> StarField::texture_means(std::span<const double> widths, double error,
                                             std::size_t most_points) const {
  if (!is_in_clumps_) return Layer::texture_means(widths, error, most_points);
  return association_means(static_cast<const AssociationTexture&>(*texture_), *this, widths, error,
                           most_points);
}

const StarClumps* StarField::clumps() const {
  if (!is_in_clumps_) return nullptr;
  std::call_once(has_clumps_, [this] {
    clumps_ = std::make_unique<const StarClumps>(static_cast<const AssociationTexture&>(*texture_),
                                                 *this);
  });
  return clumps_.get();
}

std::uint64_t StarField::key() const { return hash_text(seed_, name()); }

double StarField::bound(const Cell& cell) const {
  const auto nearest = [&](int axis) {
    return std::max(std::abs(cell.centre[axis]) - cell.half, 0.0);
  };
  const double x = nearest(0), y = nearest(1);
  double z = nearest(2);
  const double r2 = x * x + y * y;
  const double distance = std::sqrt(r2 + z * z);
  if (distance >= 1) return 0;
  const LayerShape& layer = shape();
  const double far_x = std::abs(cell.centre[0]) + cell.half;
  const double far_y = std::abs(cell.centre[1]) + cell.half;
  const double far2 = far_x * far_x + far_y * far_y;
  if (is_warped()) {
    const double above = std::abs(cell.centre[2] - layer.warp.lift(cell.centre[0], cell.centre[1]));
    const double rise = std::numbers::sqrt2 * layer.warp.steepest(std::sqrt(far2));
    z = std::max(above - cell.half * (1 + rise), 0.0);
  }
  const double farthest = std::min(std::sqrt(far2), 1.0);
  const double e = std::exp(-2 * z / (layer.z0 * layer.flare_at(farthest)));
  double value = 4 * e / ((1 + e) * (1 + e)) * law().bound(std::sqrt(r2), std::sqrt(far2)) *
                 taper_at(distance);
  if (layer.inner > 0) {
    const double ratio = layer.inner * layer.radial.axis_ratio;
    const double q = far2 / (ratio * ratio);
    value *= -std::expm1(-q * q);
  }
  if (!layer.is_even())
    value *= (1 + layer.lopsidedness * farthest) / layer.flare_at(std::sqrt(r2));
  return value;
}

int StarField::poisson(double mean, double u) {
  if (u < 1 - mean) return 0;  // u is below exp(-mean)
  double probability = std::exp(-mean), sum = probability;
  int count = 0;
  // The sum ends when rounding makes terms vanish.
  while (u >= sum && probability > 0) {
    ++count;
    probability *= mean / count;
    const double next = sum + probability;
    if (count > mean && next == sum) break;
    sum = next;
  }
  return count;
}

double StarField::luminosity(std::size_t k, const Candidate& candidate) const {
  return population_.luminosity(k, luminosity_share(candidate));
}

double StarField::luminosity_bound(std::size_t k, const Candidate& candidate) const {
  return population_.luminosity_bound(k, luminosity_share(candidate));
}

double StarField::luminosity_share(const Candidate& candidate) {
  return to_unit(mix64(candidate.key + 3 * golden_gamma));
}

double StarField::temperature(double luminosity, const Candidate& candidate) const {
  const std::uint64_t bits = mix64(candidate.key + 4 * golden_gamma);
  constexpr std::uint64_t mask = (std::uint64_t{1} << 21) - 1;
  const auto part = [&](int shift) {
    return (static_cast<double>((bits >> shift) & mask) + 0.5) * 0x1p-21;
  };
  return population_.temperature(luminosity, part(0), part(21), part(42));
}

ComponentKind starfield_kind() {
  const Parameter number = Parameter::number(
      "number", "", Interval::closed(1, largest_number).usual_logarithmic(100.0, 1000000000000.0),
      1e11, "number of stars in the galaxy, including stars that are never drawn individually");
  return {
      .name = "starfield",
      .description =
          "stars: the nearest and brightest are points of light, the others are smooth light",
      .traits = {.can_follow = true, .has_own_spectrum = true},
      .parameters = Layer::parameters() + ParameterTable{number} + StellarPopulation::parameters(),
      .noise = FractalParameters{.octaves = 4, .frequency_scale = 2, .inverse = true, .floor = 0.3},
      .make = [](const ComponentInput& input) -> std::unique_ptr<Component> {
        // A file of luminosities may have changed since the twin was read.
        const bool has_twin = input.twin != nullptr && StellarPopulation::is_formula(input.values);
        const StarField* const twin = has_twin ? input.twin->star_field() : nullptr;
        StellarPopulation population =
            twin != nullptr ? twin->population()
                            : StellarPopulation(input.values, input.context, input.resources);
        const bool has_colours = gives_temperatures(input.values, population);
        return std::make_unique<StarField>(Layer::read_shape(input), input.arms,
                                           std::move(population), input.values.number("number"),
                                           has_colours, input.settings.seed, twin);
      }};
}

}  // namespace gamer
