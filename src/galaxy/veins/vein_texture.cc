#include "galaxy/veins/vein_texture.h"

#include <array>
#include <boost/math/special_functions/bessel.hpp>
#include <map>
#include <mutex>
#include <numbers>
#include <stdexcept>

#include "galaxy/veins/vein_kernel.h"
#include "gamer/core/bound_parameter.h"
#include "gamer/core/parallel_for.h"
#include "gamer/core/random.h"
#include "gamer/core/units.h"
#include "gamer/noise/footprint.h"

namespace gamer {
namespace {

using std::numbers::pi;

double kappa_of(double width) { return 1 / (4 * pi * pi * width * width); }

/// e^-x I0(x), the mean of exp(x (cos - 1)).
// (The standard library's Bessel function writes a global variable, lgamma()'s sign.)
double mean_height(double kappa) { return boost::math::cyl_bessel_i(0, kappa) * std::exp(-kappa); }

double square_of(double kappa) {
  const double mean = mean_height(kappa);
  return mean_height(2 * kappa) - mean * mean;
}

/// A sample of a noise divided by its standard deviation, in whole batches.
const std::vector<float>& sample_of(const Noise& kind) {
  static std::mutex mutex;
  static std::map<const Noise*, std::vector<float>> known;
  const std::lock_guard lock(mutex);
  std::vector<float>& sample = known[&kind];
  constexpr std::uint64_t batches = (std::uint64_t{1} << 16) / batch_capacity;
  constexpr double extent = 4096;
  if (sample.empty()) {
    const Octave octave;
    BatchArray p[3], value;
    for (std::uint64_t b = 0; b < batches; ++b) {
      for (std::uint64_t i = 0; i < batch_capacity; ++i) {
        for (std::uint64_t axis = 0; axis < 3; ++axis) {
          p[axis][i] = static_cast<float>(extent * to_unit(hash_words({b, i, axis})));
        }
      }
      kind.sum({p[0].data(), p[1].data(), p[2].data(), batch_capacity}, std::span(&octave, 1),
               value.data());
      for (std::size_t i = 0; i < batch_capacity; ++i) {
        sample.push_back(value[i] / static_cast<float>(std::sqrt(kind.variance())));
      }
    }
  }
  return sample;
}

struct FactorMoments {
  double mean, variance;  ///< the mean, and the variance divided by the square of the mean
};

/// Moments of clamp(1 + c noise/sigma, 0, 2)^power.
FactorMoments moments_of(const Noise& kind, double contrast, double power) {
  const std::vector<float>& sample = sample_of(kind);
  double sum = 0, squares = 0;
  BatchArray factors;
  for (std::size_t first = 0; first < sample.size(); first += batch_capacity) {
    fill_factors(batch_capacity, sample.data() + first, static_cast<float>(contrast),
                 static_cast<float>(power), factors.data());
    for (std::size_t i = 0; i < batch_capacity; ++i) {
      const double factor{factors[i]};
      sum += factor;
      squares += factor * factor;
    }
  }
  const auto size = static_cast<double>(sample.size());
  const double mean = sum / size;
  return {mean, squares / size / (mean * mean) - 1};
}

MapInput map_input(const HelicalMap& map) {
  return {static_cast<float>(map.x_slope),
          static_cast<float>(map.y_slope),
          static_cast<float>(map.mean_frequency()),
          static_cast<float>(map.p),
          static_cast<float>(map.q),
          grid_magic(map.x_slope, map.p),
          grid_magic(map.y_slope, map.q)};
}

void place(Octave& octave, std::uint64_t seed, std::uint64_t index) {
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    octave.offset[axis] =
        static_cast<float>(std::floor(offset_steps * to_unit(hash_words({seed, index, axis}))) *
                           (largest_offset / offset_steps));
  }
  octave.seed = static_cast<std::uint32_t>(hash_words({seed, index, 3}));
}

/// The keys of the veins along the arms, and of the spurs.
BoundTable pattern_keys(VeinParameters& p) {
  return {{p.vein_width, "vein_width", "arm spacings", Interval::closed(0.01, 1),
           "sigma of the veins along the arms"},
          {p.spur_number, "spur_number", "", Interval::closed(0, 200).usual(0, 80),
           "spurs per turn of an arm"},
          {p.spur_width, "spur_width", "spur spacings", Interval::closed(0.01, 1),
           "sigma of the spurs"},
          {p.spur_angle, "spur_angle", "deg", Interval::closed(5, 175),
           "angle between a spur and its arm, at the arm"},
          {p.spur_curvature, "spur_curvature", "", Interval::closed(-10, 10).usual(-4, 4),
           "curvature of spurs: positive towards parallel to the arms, negative backwards"},
          {p.spur_length, "spur_length", "arm spacings", Interval::left_open(0, 3),
           "distance from its arm at which the longest spur has faded"},
          {p.spur_strength, "spur_strength", "", Interval::closed(0, 1),
           "height of the strongest spur, in units of the height of the arms' veins"},
          {p.spur_variation, "spur_variation", "", Interval::closed(0, 0.95),
           "variation of the spurs' heights and lengths"},
          {p.displacement, "displacement", "arm spacings", Interval::closed(0, 1).usual(0, 0.5),
           "rms of the noise that displaces veins and spurs together"},
          {p.displacement_frequency, "displacement_frequency", "cycles per arm spacing",
           Interval::closed(0.1, 20).usual_logarithmic(0.1, 10),
           "frequency of the displacement's first octave"},
          {p.displacement_octaves, "displacement_octaves", "", Interval::closed(1, 6),
           "octaves of the displacement, each of twice the frequency and half the height"}};
}

/// The keys of the density within veins and between them, and the seeds.
BoundTable cloud_keys(VeinParameters& p) {
  return {
      {p.density_high, "density_high", "", Interval::left_open(0, 1000).usual_logarithmic(0.1, 100),
       "D_h, density within veins; only its ratio to `density_low` counts"},
      {p.density_low, "density_low", "", Interval::closed(0, 1000).usual(0, 10),
       "D_l, density between veins"},
      {p.octaves, "octaves", "",
       Interval::closed(1, double{FractalParameters::most_octaves}).usual(1, 12),
       "octaves of the noise that multiplies the density; default as listed only "
       "if the render parameters have no `noise.octaves`"},
      {p.noise_frequency, "noise_frequency", "cycles per arm spacing",
       Interval::closed(0.1, 50).usual_logarithmic(0.3, 20),
       "frequency of the noise's first octave, across the spurs"},
      {p.noise_contrast, "noise_contrast", "", Interval::closed(0, 1),
       "rms of the octave whose cells are `isotropic_scale` large"},
      {p.spectral_index, "spectral_index", "", Interval::closed(0, 6),
       "the column density's power spectrum falls as |k|^-spectral_index"},
      {p.clumpiness, "clumpiness", "", Interval::closed(0.1, 12),
       "power of the octaves below `isotropic_scale`; large values make knots"},
      {p.anisotropy, "anisotropy", "", Interval::closed(1, 10),
       "ratio of length to width of clouds"},
      {p.anisotropy_angle, "anisotropy_angle", "deg", Interval::closed(0, 180),
       "angle between clouds and arms"},
      {p.isotropic_scale, "isotropic_scale", "galaxy radii",
       Interval::left_open(0, 1).usual_logarithmic(0.003, 0.5),
       "scale above which clouds grow with the radius and follow the arms; smaller clouds "
       "are isotropic and uniform"},
      without_default({p.seed, "seed", "", Interval::closed(0, largest_seed),
                       "seed of this component's noise; default: from the galaxy's seed and the "
                       "component's name"}),
      {p.pattern_seed, "pattern_seed", "", Interval::closed(0, largest_seed),
       "seed of displacement and spurs: veins of one galaxy with equal seed and shape coincide"}};
}

}  // namespace

ParameterTable VeinParameters::table() const {
  return declarations(pattern_keys, *this) + declarations(cloud_keys, *this);
}

void VeinParameters::apply(const ParameterSet& values) {
  put_values(values, pattern_keys(*this));
  put_values(values, cloud_keys(*this));
}

/// Points of a batch, and their visible structure.
struct VeinTexture::Batch {
  const Points& points;
  std::span<VeinView> views;
  SpiralBatch spiral;
  Range radii;  ///< range of 1/r

  Batch(const Points& at, const SpiralCoordinates& coordinates, std::span<VeinView> views_of_it)
      : points(at), views(views_of_it) {
    coordinates.at(points, spiral);
    radii = range_of(spiral.inverse_radius.data(), points.size);
    for (VeinView& view : views) {
      view.widths =
          view.footprints != nullptr ? range_of(view.footprints, points.size) : Range{0, 0};
    }
  }
  // Margin of a visible share. Rounding is smaller, so that a share beyond the margin is exactly 0
  // or 1.
  static constexpr double margin = 1e-5;
  /// Whether any point of any view resolves a part of the octave; otherwise the share is exactly 0.
  bool sees(const SeenInput& octave) const {
    return std::ranges::any_of(views, [&](const VeinView& view) {
      return double{octave.sharpest * view.widths.least * (octave.helical ? radii.least : 1)} <
             fade_end * (1 + margin);
    });
  }
  /// Whether the octave is partly hidden at any point of a view; otherwise the share is exactly 1.
  bool fades(const VeinView& view, const SeenInput& octave) const {
    return double{octave.sharpest * view.widths.most * (octave.helical ? radii.most : 1)} >
           fade_begin * (1 - margin);
  }
  /// Whether a helical octave counts at any point; otherwise its share is exactly 0.
  bool blends(const MultiplyInput& octave) const {
    return octave.blend_shift - std::log2(radii.least) > -margin;
  }
};

/// All inputs of the kernels, and the Cartesian octaves of N.
struct VeinTexture::Inputs {
  DisplacementInput displacement;
  VeinInput veins;
  std::vector<MultiplyInput> octaves;  ///< helical ones first
  std::size_t helical = 0;             ///< number of helical octaves
  bool cycles = false;                 ///< whether a helical octave has a period in y
  std::vector<Octave> product;         ///< the Cartesian octaves, of weight c/sigma
};

namespace {

/// The displacement: octaves of frequencies 2^j and weights 2^-j, with the wanted total rms.
DisplacementInput displacement_of(const VeinParameters& p, const SpiralCoordinates& coordinates) {
  double variance = 0;
  for (int j = 0; j < p.displacement_octaves; ++j) variance += std::pow(0.25, j);
  const HelicalMap map = HelicalMap::isotropic(coordinates, p.displacement_frequency);
  DisplacementInput in{map_input(map), {}};
  if (p.displacement == 0) return in;
  for (int j = 0; j < p.displacement_octaves; ++j) {
    Octave octave;
    octave.frequency = static_cast<float>(std::exp2(j));
    octave.weight = static_cast<float>(p.displacement * std::exp2(-j) /
                                       std::sqrt(variance * perlin_noise().variance()));
    octave.translation[0] = map.p << j;
    place(octave, hash_words({p.pattern_seed, 2}), static_cast<std::uint64_t>(j));
    in.octaves.push_back(
        {octave,
         {static_cast<float>(map.mean_frequency()) * octave.frequency, true},
         octave.weight * octave.weight * static_cast<float>(perlin_noise().variance())});
  }
  return in;
}

/// V of unresolved veins: the mean between arms 0 and 1 at mean strength, without the correlation
/// of veins and spurs.
double unresolved_veins(const VeinParameters& p) {
  constexpr double fade_mean = 8.0 / 15;
  const double arms = mean_height(kappa_of(p.vein_width));
  const double spurs = mean_height(kappa_of(p.spur_width));
  return 1 - (1 - arms) * (1 - std::min(p.spur_length, 1.0) * fade_mean * spurs * p.spur_strength *
                                   (1 - 0.5 * p.spur_variation));
}

VeinInput veins_of(const VeinParameters& p, const SpiralCoordinates& coordinates, double finest) {
  VeinInput in{};
  in.count = static_cast<float>(coordinates.count());
  in.inverse_count = static_cast<float>(1.0 / coordinates.count());
  in.cycle = static_cast<float>(coordinates.cycle());
  // Radius inside which there are no veins.
  constexpr double innermost = 0.01;
  in.magic = grid_magic(1 + coordinates.count() + std::abs(coordinates.at(innermost, 0).u) +
                        std::abs(coordinates.at(1, 0).u));
  const double vein_kappa = kappa_of(p.vein_width);
  in.vein_kappa = static_cast<float>(vein_kappa);
  in.vein_y = static_cast<float>(bessel_border / vein_kappa);
  in.vein_mean = static_cast<float>(mean_height(vein_kappa));
  in.vein_square = static_cast<float>(square_of(vein_kappa));
  const double spur_kappa = kappa_of(p.spur_width);
  in.spur_kappa = static_cast<float>(spur_kappa);
  in.spur_y = static_cast<float>(bessel_border / spur_kappa);
  in.spur_mean = static_cast<float>(mean_height(spur_kappa));
  in.spur_square = static_cast<float>(square_of(spur_kappa));
  const double tangent = coordinates.reference_tangent();
  in.rate = static_cast<float>(p.spur_number / (coordinates.cycle() * (1 + tangent * tangent)));
  in.slope = static_cast<float>(1 / std::tan(p.spur_angle * degree));
  in.curvature = static_cast<float>(p.spur_curvature);
  in.inverse_length = static_cast<float>(1 / p.spur_length);
  in.strength = p.spur_number > 0 ? static_cast<float>(p.spur_strength) : 0.0f;
  in.variation = static_cast<float>(p.spur_variation);
  in.inverse_rise = static_cast<float>(1 / std::min(p.vein_width, 0.5 * p.spur_length));
  in.branches = static_cast<int>(std::ceil(p.spur_length));
  for (int arm = 0; arm < coordinates.count(); ++arm) {
    in.phases.push_back(static_cast<float>(
        to_unit(hash_words({p.pattern_seed, 1, static_cast<std::uint64_t>(arm)}))));
  }
  in.phases.resize(padded(in.phases.size()));
  in.seed = static_cast<std::uint32_t>(hash_words({p.pattern_seed, 4}));
  const double rise = p.density_high - p.density_low;
  const double mean = unresolved_veins(p);
  in.high = static_cast<float>(rise);
  in.low = static_cast<float>(p.density_low);
  in.mean = static_cast<float>(mean);
  in.core = static_cast<float>(p.isotropic_scale);
  const double start = fade_begin / finest;
  in.square_start = static_cast<float>(start * start);
  const double contrast = rise / (rise * mean + p.density_low);
  in.relative = static_cast<float>(contrast * contrast);
  return in;
}

}  // namespace

VeinTexture::VeinTexture(const VeinParameters& parameters, const SpiralCoordinates& coordinates,
                         double thickness)
    : ScaledTexture("the veins are zero or infinite over the whole component"),
      parameters_(parameters),
      coordinates_(coordinates) {
  if (parameters.octaves > most_octaves || parameters.displacement_octaves > most_octaves) {
    throw std::invalid_argument("veins have at most 32 octaves");
  }
  auto inputs = std::make_shared<Inputs>();
  inputs->displacement = displacement_of(parameters, coordinates);

  // N: helical octaves up to the isotropic scale at radius 1, then Cartesian ones.
  const double isotropic = 1 / parameters.isotropic_scale;
  double frequency = 0;
  for (int k = 0; k < parameters.octaves; ++k) {
    MultiplyInput next{};
    place(next.octave, parameters.seed, static_cast<std::uint64_t>(k));
    next.clumpiness = next.inverse_mean = 1;
    double contrast = parameters.noise_contrast;
    const HelicalMap map =
        HelicalMap::along(coordinates, parameters.noise_frequency * std::exp2(k),
                          parameters.anisotropy, parameters.anisotropy_angle * degree);
    const bool helical = map.mean_frequency() < isotropic * std::numbers::sqrt2;
    if (helical) {
      frequency = map.mean_frequency();
      const double sharpest = std::max(map.x_frequency(), map.y_frequency());
      next.map = map_input(map);
      next.octave.translation[0] = map.p;
      next.octave.translation[1] = map.q;
      next.seen = {static_cast<float>(sharpest), true};
      next.blend_shift = static_cast<float>(0.5 - std::log2(frequency / isotropic));
      next.contrast = static_cast<float>(contrast / std::sqrt(perlin_noise().variance()));
      next.variance = static_cast<float>(contrast * contrast);
      inputs->cycles = inputs->cycles || map.p == 0;
      ++inputs->helical;
      finest_ = isotropic * std::numbers::sqrt2 * sharpest / frequency;
    } else {
      const bool first = inputs->octaves.size() == inputs->helical;
      frequency = first ? isotropic * std::numbers::sqrt2 : 2 * frequency;
      contrast *= std::sqrt(std::pow(frequency / isotropic, 2 - parameters.spectral_index) *
                            (1 + 2 * thickness * frequency) / (1 + 2 * thickness * isotropic));
      contrast = std::min(contrast, double{largest_contrast});
      const Noise& kind = *parameters.small_kind;
      next.octave.frequency = static_cast<float>(frequency);
      next.seen = {static_cast<float>(frequency), false};
      next.contrast = static_cast<float>(contrast / std::sqrt(kind.variance()));
      next.variance = static_cast<float>(contrast * contrast);
      if (parameters.clumpiness != 1) {
        const FactorMoments moments = moments_of(kind, contrast, parameters.clumpiness);
        next.clumpiness = static_cast<float>(parameters.clumpiness);
        next.inverse_mean = static_cast<float>(1 / moments.mean);
        next.variance = static_cast<float>(moments.variance);
      }
      inputs->product.push_back(next.octave);
      inputs->product.back().weight = next.contrast;
      finest_ = frequency;
    }
    next.layers = static_cast<float>(2 * thickness * frequency);
    inputs->octaves.push_back(next);
  }
  inputs->veins = veins_of(parameters, coordinates, finest_);
  inputs_ = std::move(inputs);
}

bool VeinTexture::hides(double footprint) const { return footprint * finest_ > fade_begin; }

void VeinTexture::displace(Batch& batch, std::uint64_t& evaluations) const {
  const std::vector<DisplacementOctave>& octaves = inputs_->displacement.octaves;
  evaluations += batch.points.size * octaves.size();
  for (VeinView& view : batch.views) {
    view.whole = 0;
    while (view.whole < octaves.size() && !batch.fades(view, octaves[view.whole].seen)) {
      ++view.whole;
    }
  }
  fill_displacement(batch.points, batch.spiral, inputs_->displacement, batch.views);
}

void VeinTexture::base(const Batch& batch, Parts* parts) const {
  for (const VeinView& view : batch.views) {
    fill_veins(batch.points.size, batch.spiral, view.footprints, view.displacement.data(),
               view.unseen.data(), inputs_->veins, view.density, view.coherent,
               parts != nullptr ? parts->arms.data() : nullptr,
               parts != nullptr ? parts->spurs.data() : nullptr,
               parts != nullptr ? parts->veins.data() : nullptr);
  }
}

void VeinTexture::multiply(Batch& batch, std::uint64_t& evaluations) const {
  if (parameters_.noise_contrast == 0) return;
  const Points& points = batch.points;
  const auto counted = [&](std::size_t k) -> CountedOctave {
    const MultiplyInput& in = inputs_->octaves[k];
    return {&in, k, batch.sees(in.seen)};
  };
  for (VeinView& view : batch.views) {
    for (std::size_t k = 0; k < inputs_->octaves.size(); ++k) {
      view.fades[k] = batch.fades(view, inputs_->octaves[k].seen);
    }
  }

  std::array<CountedOctave, most_octaves> helical;
  std::size_t count = 0;
  for (std::size_t k = 0; k < inputs_->helical; ++k) {
    if (!batch.blends(inputs_->octaves[k])) continue;
    helical[count] = counted(k);
    if (helical[count].seen) evaluations += points.size;
    ++count;
  }
  if (count > 0) {
    multiply_helical(points, batch.spiral, helical.data(), count, inputs_->cycles, batch.views);
  }

  const Noise& kind = *parameters_.small_kind;
  // The product begins with the octaves that all points resolve. Their number affects neither the
  // factors, to the last bit, nor their order. The value at a point therefore does not depend on
  // other points.
  BatchArray value;
  std::size_t whole = 0;
  if (parameters_.clumpiness == 1) {
    const auto fades = [&](std::size_t k) {
      return std::ranges::any_of(batch.views, [&](const VeinView& view) { return view.fades[k]; });
    };
    while (whole < inputs_->product.size() && !fades(inputs_->helical + whole)) ++whole;
  }
  const auto factors = [&](std::size_t first, std::size_t octaves) {
    kind.combine({Combination::Kind::multiplicative}, points,
                 std::span(inputs_->product).subspan(first, octaves), value.data());
    evaluations += points.size * octaves;
  };
  factors(0, whole);
  for (VeinView& view : batch.views) view.product = value;
  for (std::size_t n = whole; n < inputs_->product.size(); ++n) {
    const CountedOctave octave = counted(inputs_->helical + n);
    if (octave.seen) {
      factors(n, 1);
    } else {
      std::fill_n(value.data(), padded(points.size), 1.0f);
    }
    multiply_cartesian(points.size, value.data(), octave, batch.views);
  }
  for (const VeinView& view : batch.views) {
    multiply_by(points.size, view.product.data(), view.density);
  }
}

void VeinTexture::parts(const Points& points, Parts& out) const {
  BatchArray density;
  VeinView view(nullptr, density.data(), nullptr);
  Batch batch(points, coordinates_, std::span(&view, 1));
  std::uint64_t evaluations = 0;
  displace(batch, evaluations);
  base(batch, &out);
  out.displacement = view.displacement;
  std::fill_n(density.data(), padded(points.size), 1.0f);
  multiply(batch, evaluations);
  out.noise = density;
}

void VeinTexture::look(const Points& points, std::span<VeinView> views,
                       std::uint64_t& evaluations) const {
  Batch batch(points, coordinates_, views);
  displace(batch, evaluations);
  base(batch, nullptr);
  multiply(batch, evaluations);
}

void VeinTexture::evaluate_whole(const Points& points, BatchArray& out,
                                 std::uint64_t& evaluations) const {
  BatchArray density;
  VeinView view(nullptr, density.data(), nullptr);
  look(points, std::span(&view, 1), evaluations);
  fill_scaled(points.size, density.data(), static_cast<float>(scale()), out.data());
}

void VeinTexture::see(const Points& points, std::span<const float* const> footprints,
                      bool wants_coherent, std::span<SeenNoise> out,
                      std::uint64_t& evaluations) const {
  std::vector<VeinView> views;
  views.reserve(out.size());
  for (std::size_t v = 0; v < out.size(); ++v) {
    views.emplace_back(footprints[v], out[v].sum.data(),
                       wants_coherent ? out[v].coherent.data() : nullptr);
  }
  look(points, views, evaluations);
}

void VeinTexture::expect(std::size_t size, const SeenNoise& seen, const float* coherence,
                         std::span<const double> deviations, std::span<BatchArray> out) const {
  const auto factor = static_cast<float>(scale());
  if (out.size() == 1) {
    fill_scaled(size, seen.sum.data(), factor, out[0].data());
    return;
  }
  for (std::size_t k = 0; k < out.size(); ++k) {
    deviate(size, seen.sum.data(), seen.coherent.data(), coherence, factor,
            static_cast<float>(deviations[k]), out[k].data());
  }
}

void VeinTexture::normalise(std::span<const WeightedBatch> cloud,
                            const FractalNoise::Factor& factor) {
  ScaledTexture::normalise(cloud, factor);
  take_frequency(cloud);
}

std::vector<BatchArray> VeinTexture::phi(std::span<const WeightedBatch> cloud) const {
  std::vector<BatchArray> values(cloud.size());
  parallel_for(cloud.size(), [&](std::size_t b) {
    std::uint64_t evaluations = 0;
    evaluate_whole(cloud[b].points(), values[b], evaluations);
  });
  return values;
}

void VeinTexture::take_frequency(std::span<const WeightedBatch> cloud) {
  // Cycles per radius, from the mean square of the gradient divided by the mean square of the
  // fluctuation.
  const double shift = 0.1 / finest_;
  const std::vector<BatchArray> here = phi(cloud);
  double gradients = 0, weights = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<WeightedBatch> moved(cloud.begin(), cloud.end());
    for (WeightedBatch& batch : moved) {
      BatchArray& coordinate = axis == 0 ? batch.x : axis == 1 ? batch.y : batch.z;
      for (std::size_t i = 0; i < batch.size; ++i) coordinate[i] += static_cast<float>(shift);
    }
    const std::vector<BatchArray> there = phi(moved);
    for (std::size_t b = 0; b < cloud.size(); ++b) {
      for (std::size_t i = 0; i < cloud[b].size; ++i) {
        const double slope = (double{there[b][i]} - double{here[b][i]}) / shift;
        gradients += cloud[b].weight[i] * slope * slope;
        if (axis == 0) weights += cloud[b].weight[i];
      }
    }
  }
  frequency_ = std::sqrt(gradients / weights / std::max(rms() * rms() - 1, 1e-6)) / (2 * pi);
}

}  // namespace gamer
