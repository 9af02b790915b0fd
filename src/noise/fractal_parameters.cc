#include "gamer/noise/fractal_parameters.h"

#include <cmath>

#include "gamer/core/bound_parameter.h"
#include "gamer/core/random.h"

namespace gamer {
namespace {

// Offsets stay within a few cells: they only keep lattice points of different octaves apart, and
// larger ones would cost precision.
constexpr double largest_offset = 16.0;

// At higher frequencies coordinates in single precision are too coarse for a smooth noise
// (noise.h).
constexpr double largest_frequency = 1e5;

// Default lacunarity of multiplicative and ridged combinations.
constexpr double usual_lacunarity = 2.0;

// With this floor |v|^-20 stays within single precision.
constexpr double smallest_floor = 1e-2;

/// Throws InputError where a given parameter has no effect.
void refuse_meaningless(const FractalParameters& noise, const ParameterSet& values,
                        const std::string& context) {
  const auto refuse = [&](const char* key, const std::string& why) {
    if (values.is_given(key)) throw InputError(values.where(key), context + key + why);
  };
  const std::string& name = values.text("combination");
  if (noise.is_density()) {
    for (const char* key : {"exponent", "theta", "offset", "contrast", "floor"}) {
      refuse(key, " shapes sums of octaves; combination = \"" + name +
                      "\" is a density as it is, so leave it out");
    }
  }
  if (noise.combination.kind != Combination::Kind::ridged) {
    for (const char* key : {"ridge_offset", "ridge_gain"}) {
      refuse(key, " belongs to combination = \"ridged\", not \"" + name + "\"");
    }
  }
  if (noise.combination.kind == Combination::Kind::multiplicative) {
    refuse("spectral_index",
           " weighs terms of a sum; combination = \"multiplicative\" has amplitude instead");
  } else {
    refuse("amplitude", " belongs to combination = \"multiplicative\", not \"" + name + "\"");
  }
  if (noise.warp == 0) {
    for (const char* key : {"warp_frequency", "warp_octaves"}) {
      refuse(key, " has no meaning without warp");
    }
  }
}

void refuse_contradictions(const FractalParameters& noise, const ParameterSet& values,
                           const std::string& context) {
  refuse_meaningless(noise, values, context);
  if (noise.lacunarity > 0 && noise.lacunarity <= 1) {
    throw InputError(values.where("lacunarity"),
                     context + "lacunarity must be above 1, or 0 for linear frequencies");
  }
  if (noise.frequency(noise.octaves) > largest_frequency) {
    throw InputError(values.where(values.is_given("lacunarity") ? "lacunarity" : "octaves"),
                     context + "lacunarity " + value_text(noise.lacunarity) + " gives octave " +
                         std::to_string(noise.octaves) +
                         " more than 1e5 cycles per galaxy radius; take fewer octaves");
  }
  if (!noise.inverse && noise.exponent < 0) {
    throw InputError(values.where("exponent"),
                     context +
                         "exponent below 0 has no meaning where theta is 'linear'; use "
                         "theta = \"inverse\" with a positive exponent");
  }
}

}  // namespace

bool FractalParameters::is_density() const {
  return combination.kind == Combination::Kind::multiplicative ||
         combination.kind == Combination::Kind::ridged;
}

double FractalParameters::frequency(int k) const {
  if (lacunarity == 0) return k0 + frequency_scale * k;
  return (k0 + frequency_scale) * std::pow(lacunarity, k - 1);
}

double FractalParameters::weight(int k) const {
  switch (combination.kind) {
    case Combination::Kind::multiplicative: return amplitude;
    case Combination::Kind::ridged: return std::pow(frequency(k) / frequency(1), -spectral_index);
    default: return std::pow(frequency(k), -spectral_index);
  }
}

void scatter(Octave& octave, const std::function<std::uint64_t(std::uint64_t)>& hash) {
  for (std::uint64_t axis = 0; axis < 3; ++axis) {
    octave.offset[axis] = static_cast<float>(largest_offset * to_unit(hash(axis)));
  }
  octave.seed = static_cast<std::uint32_t>(hash(3));
}

namespace {

/// The keys of the octaves.
BoundTable octave_keys(FractalParameters& p) {
  return {
      Parameter::choice("kind", noise_names(), std::nullopt,
                        "base noise P; default: `noise.kind` of the render parameters"),
      choice(p.combination.kind, "combination",
             {{"additive", Combination::Kind::additive},
              {"multiplicative", Combination::Kind::multiplicative},
              {"ridged", Combination::Kind::ridged},
              {"billow", Combination::Kind::billow}},
             "combination of octaves: additive sum w n; multiplicative product of 1 + a "
             "n in [0, 2]; ridged multifractal of (o - |n|)^2; billow sum w |n|"),
      {p.octaves, "octaves", "",
       Interval::closed(1, double{FractalParameters::most_octaves}).usual(1, 12),
       "omega, number of octaves; default as listed only if the render "
       "parameters have no `noise.octaves`"},
      {p.k0, "k0", "cycles per galaxy radius", Interval::closed(0, 1000).usual(0, 40),
       "offset of the frequencies k0 + f_s k"},
      {p.frequency_scale, "frequency_scale", "cycles per galaxy radius",
       Interval::left_open(0, 1000).usual_logarithmic(0.2, 60), "f_s, spacing of the frequencies"},
      Parameter::number("lacunarity", "", Interval::closed(0, 4), std::nullopt,
                        "l, ratio of the frequencies (k0 + f_s) l^(k - 1), above 1; 0: k0 + f_s k. "
                        "Default: 0 where additive or billow, else 2"),
      {p.spectral_index, "spectral_index", "", Interval::closed(-10, 10).usual(0, 3),
       "nu: octave k of frequency f has weight f^-nu"},
      {p.amplitude, "amplitude", "", Interval::left_open(0, 4).usual(0.1, 2),
       "a, amplitude of every octave of multiplicative noise"},
      {p.combination.ridge_offset, "ridge_offset", "", Interval::left_open(0, 4).usual(0.2, 2),
       "o, height of the ridges"},
      {p.combination.ridge_gain, "ridge_gain", "",
       Interval::left_open(0, 100).usual_logarithmic(0.2, 20),
       "G: a ridge of height s scales the next octave by G s, at most 1"},
      {p.warp, "warp", "galaxy radii", Interval::closed(0, 10).usual(0, 0.3),
       "rms displacement of the noise along each axis by a vector noise"},
      {p.warp_frequency, "warp_frequency", "cycles per galaxy radius",
       Interval::left_open(0, 1000).usual_logarithmic(0.3, 30),
       "frequency of the displacement's first octave"},
      {p.warp_octaves, "warp_octaves", "", Interval::closed(1, 16).usual(1, 6),
       "octaves of the displacement: 1 varies the lacunarity, several warp the domain"}};
}

/// The keys of the shape, and the seed.
BoundTable shape_keys(FractalParameters& p) {
  return {
      {p.exponent, "exponent", "", Interval::closed(-20, 20).usual(-1, 8),
       "alpha, power of the shaped noise"},
      choice(p.inverse, "theta", {{"linear", false}, {"inverse", true}},
             "shape: linear max(v, 0)^alpha or inverse max(|v|, floor)^-alpha"),
      {p.offset, "offset", "sigmas", Interval::closed(-10, 10).usual(-3, 4),
       "added to the normalised sum"},
      {p.contrast, "contrast", "", Interval::left_open(0, 10).usual_logarithmic(0.1, 4),
       "factor of the normalised sum"},
      {p.floor, "floor", "sigmas", Interval::closed(smallest_floor, 10).usual_logarithmic(0.01, 2),
       "least |v| of the inverse shape"},
      without_default({p.seed, "seed", "", Interval::closed(0, largest_seed),
                       "seed of this component's noise; default: from the galaxy's seed and the "
                       "component's name"})};
}

}  // namespace

ParameterTable FractalParameters::table() const {
  return declarations(octave_keys, *this) + declarations(shape_keys, *this);
}

void FractalParameters::apply(const ParameterSet& values, const std::string& context) {
  put_values(values, octave_keys(*this));
  put_values(values, shape_keys(*this));
  if (values.has("kind")) kind = &find_noise(values.text("kind"));
  if (values.has("lacunarity")) {
    lacunarity = values.number("lacunarity");
  } else if (is_density()) {
    lacunarity = usual_lacunarity;
  }
  refuse_contradictions(*this, values, context);
}

std::vector<Octave> FractalParameters::make_octaves() const {
  std::vector<Octave> result(static_cast<std::size_t>(octaves));
  for (int k = 1; k <= octaves; ++k) {
    Octave& octave = result[static_cast<std::size_t>(k - 1)];
    octave.frequency = static_cast<float>(frequency(k));
    octave.weight = static_cast<float>(weight(k));
    scatter(octave, [&](std::uint64_t part) {
      return hash_words({seed, static_cast<std::uint64_t>(k), part});
    });
  }
  return result;
}

}  // namespace gamer
