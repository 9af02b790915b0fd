#include "gamer/scene/sampling_settings.h"

#include "gamer/core/random.h"
#include "scene/section_values.h"

namespace gamer {
namespace {

constexpr double largest_octaves = 32;
constexpr double most_stars_per_pixel = 1e6;
// Galaxy radii: 2e6 steps across a galaxy.
constexpr double smallest_step = 1e-6;

}  // namespace

ParameterSection NoiseSettings::section() {
  return {
      "noise",
      "The procedural noise of all components.",
      {Parameter::choice("kind", noise_names(), "simplex", "base noise"),
       Parameter::integer(
           "octaves", "", Interval::closed(1, largest_octaves), std::nullopt,
           "default of the components' key octaves; without it each kind has its own default"),
       Parameter::integer("seed", "", Interval::closed(0, largest_seed), 1,
                          "seed of all noise; another number makes other galaxies of equal types")},
      {}};
}

NoiseSettings NoiseSettings::read(const ParameterSet& values) {
  return {.kind = &find_noise(values.text("kind")),
          .octaves = optional_integer(values, "octaves"),
          .seed = static_cast<std::uint64_t>(values.integer("seed"))};
}

ParameterSection SamplingSettings::section() {
  return {"sampling",
          "How rays are sampled.",
          {Parameter::choice("sampler", {"uniform", "adaptive"}, "adaptive",
                             "method: equal steps, or steps that follow the components"),
           Parameter::number("step", "galaxy radii", Interval::closed(smallest_step, 1), 0.01,
                             "uniform sampler: step along the ray"),
           Parameter::number("tolerance", "", Interval::open(0, 1), 1e-3,
                             "rms relative error over pixels above 1 % of the peak (adaptive "
                             "sampler); also the limit below which faint light has no texture")
               .usual_logarithmic(0.0001, 0.1),
           Parameter::number("stars_per_pixel", "", Interval::closed(0, most_stars_per_pixel),
                             std::nullopt,
                             "expected number of individual stars of a star field in the pixel "
                             "with the most; other stars are smooth light; by default 1, and 0 for "
                             "galaxies of at most 256 pixels across in calibrated sky views")},
          {{"step", "sampler", {"uniform"}}}};
}

SamplingSettings SamplingSettings::read(const ParameterSet& values) {
  const bool is_uniform = values.text("sampler") == "uniform";
  return {.sampler = is_uniform ? SamplerKind::uniform : SamplerKind::adaptive,
          .step = values.number("step"),
          .tolerance = values.number("tolerance"),
          .stars_per_pixel = optional_number(values, "stars_per_pixel")};
}

}  // namespace gamer
