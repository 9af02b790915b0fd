#include "gamer/noise/fractal_parameters.h"

#include <cmath>

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

struct CombinationName {
  const char* name;
  Combination::Kind kind;
};
constexpr CombinationName combination_names[] = {
    {"additive", Combination::Kind::additive},
    {"multiplicative", Combination::Kind::multiplicative},
    {"ridged", Combination::Kind::ridged},
    {"billow", Combination::Kind::billow}};

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

/// The keys of the shape, and the seed.
ParameterTable shape_table(const FractalParameters& values) {
  return {
      Parameter::number("exponent", "", Interval::closed(-20, 20), values.exponent,
                        "alpha, power of the shaped noise")
          .usual(-1, 8),
      Parameter::choice("theta", {"linear", "inverse"},
                        std::string(values.inverse ? "inverse" : "linear"),
                        "shape: linear max(v, 0)^alpha or inverse max(|v|, floor)^-alpha"),
      Parameter::number("offset", "sigmas", Interval::closed(-10, 10), values.offset,
                        "added to the normalised sum")
          .usual(-3, 4),
      Parameter::number("contrast", "", Interval::left_open(0, 10), values.contrast,
                        "factor of the normalised sum")
          .usual_logarithmic(0.1, 4),
      Parameter::number("floor", "sigmas", Interval::closed(smallest_floor, 10), values.floor,
                        "least |v| of the inverse shape")
          .usual_logarithmic(0.01, 2),
      Parameter::integer("seed", "", Interval::closed(0, largest_seed), std::nullopt,
                         "seed of this component's noise; default: from the galaxy's seed and the "
                         "component's name"),
  };
}

}  // namespace

ParameterTable FractalParameters::table() const {
  std::string combination_name;
  std::vector<std::string> combinations;
  for (const CombinationName& known : combination_names) {
    combinations.emplace_back(known.name);
    if (known.kind == combination.kind) combination_name = known.name;
  }
  const ParameterTable octaves_of = {
      Parameter::choice("kind", noise_names(), std::nullopt,
                        "base noise P; default: `noise.kind` of the render parameters"),
      Parameter::choice("combination", combinations, combination_name,
                        "combination of octaves: additive sum w n; multiplicative product of 1 + a "
                        "n in [0, 2]; ridged multifractal of (o - |n|)^2; billow sum w |n|"),
      Parameter::integer("octaves", "", Interval::closed(1, double{most_octaves}), octaves,
                         "omega, number of octaves; default as listed only if the render "
                         "parameters have no `noise.octaves`")
          .usual(1, 12),
      Parameter::number("k0", "cycles per galaxy radius", Interval::closed(0, 1000), k0,
                        "offset of the frequencies k0 + f_s k")
          .usual(0, 40),
      Parameter::number("frequency_scale", "cycles per galaxy radius", Interval::left_open(0, 1000),
                        frequency_scale, "f_s, spacing of the frequencies")
          .usual_logarithmic(0.2, 60),
      Parameter::number("lacunarity", "", Interval::closed(0, 4), std::nullopt,
                        "l, ratio of the frequencies (k0 + f_s) l^(k - 1), above 1; 0: k0 + f_s k. "
                        "Default: 0 where additive or billow, else 2"),
      Parameter::number("spectral_index", "", Interval::closed(-10, 10), spectral_index,
                        "nu: octave k of frequency f has weight f^-nu")
          .usual(0, 3),
      Parameter::number("amplitude", "", Interval::left_open(0, 4), amplitude,
                        "a, amplitude of every octave of multiplicative noise")
          .usual(0.1, 2),
      Parameter::number("ridge_offset", "", Interval::left_open(0, 4),
                        double{combination.ridge_offset}, "o, height of the ridges")
          .usual(0.2, 2),
      Parameter::number("ridge_gain", "", Interval::left_open(0, 100),
                        double{combination.ridge_gain},
                        "G: a ridge of height s scales the next octave by G s, at most 1")
          .usual_logarithmic(0.2, 20),
      Parameter::number("warp", "galaxy radii", Interval::closed(0, 10), warp,
                        "rms displacement of the noise along each axis by a vector noise")
          .usual(0, 0.3),
      Parameter::number("warp_frequency", "cycles per galaxy radius", Interval::left_open(0, 1000),
                        warp_frequency, "frequency of the displacement's first octave")
          .usual_logarithmic(0.3, 30),
      Parameter::integer(
          "warp_octaves", "", Interval::closed(1, 16), warp_octaves,
          "octaves of the displacement: 1 varies the lacunarity, more warp the domain")
          .usual(1, 6),
  };
  return octaves_of + shape_table(*this);
}

void FractalParameters::apply(const ParameterSet& values, const std::string& context) {
  if (values.has("kind")) kind = &find_noise(values.text("kind"));
  for (const CombinationName& known : combination_names) {
    if (known.name == values.text("combination")) combination.kind = known.kind;
  }
  octaves = static_cast<int>(values.integer("octaves"));
  k0 = values.number("k0");
  frequency_scale = values.number("frequency_scale");
  if (values.has("lacunarity")) {
    lacunarity = values.number("lacunarity");
  } else if (is_density()) {
    lacunarity = usual_lacunarity;
  }
  spectral_index = values.number("spectral_index");
  amplitude = values.number("amplitude");
  combination.ridge_offset = static_cast<float>(values.number("ridge_offset"));
  combination.ridge_gain = static_cast<float>(values.number("ridge_gain"));
  warp = values.number("warp");
  warp_frequency = values.number("warp_frequency");
  warp_octaves = static_cast<int>(values.integer("warp_octaves"));
  exponent = values.number("exponent");
  inverse = values.text("theta") == "inverse";
  offset = values.number("offset");
  contrast = values.number("contrast");
  floor = values.number("floor");
  if (values.has("seed")) seed = static_cast<std::uint64_t>(values.integer("seed"));
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
