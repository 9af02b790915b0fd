#include "gamer/scene/sampling_settings.h"

#include "gamer/core/bound_parameter.h"
#include "gamer/core/random.h"

namespace gamer {
namespace {

constexpr double largest_octaves = 32;
constexpr double most_stars_per_pixel = 1e6;
// Galaxy radii: 2e6 steps across a galaxy.
constexpr double smallest_step = 1e-6;

BoundTable noise_keys(NoiseSettings& p) {
  return {Parameter::choice("kind", noise_names(), "simplex", "base noise"),
          {p.octaves, "octaves", "", Interval::closed(1, largest_octaves),
           "default of the components' key octaves; without it each kind has its own default"},
          {p.seed, "seed", "", Interval::closed(0, largest_seed),
           "seed of all noise; another number makes other galaxies of equal types"}};
}

BoundTable sampling_keys(SamplingSettings& p) {
  return {choice(p.sampler, "sampler",
                 {{"uniform", SamplerKind::uniform}, {"adaptive", SamplerKind::adaptive}},
                 "method: equal steps, or steps that follow the components"),
          {p.step, "step", "galaxy radii", Interval::closed(smallest_step, 1),
           "uniform sampler: step along the ray"},
          {p.tolerance, "tolerance", "", Interval::open(0, 1).usual_logarithmic(0.0001, 0.1),
           "adaptive sampler: rms relative error over pixels above 1 % of the peak; "
           "light fainter than this share has no texture"},
          {p.stars_per_pixel, "stars_per_pixel", "", Interval::closed(0, most_stars_per_pixel),
           "expected number of individual stars of a star field in the pixel "
           "with the most; other stars are smooth light; by default 1, and 0 for "
           "galaxies of up to 256 pixels across in calibrated sky views"}};
}

}  // namespace

ParameterSection NoiseSettings::section() {
  return {"noise", "The procedural noise of all components.", declarations(noise_keys)};
}

NoiseSettings NoiseSettings::read(const ParameterSet& values) {
  NoiseSettings result = read_object(values, noise_keys);
  result.kind = &find_noise(values.text("kind"));
  return result;
}

ParameterSection SamplingSettings::section() {
  return {"sampling",
          "How rays are sampled.",
          declarations(sampling_keys),
          {{"step", "sampler", {"uniform"}}}};
}

SamplingSettings SamplingSettings::read(const ParameterSet& values) {
  return read_object(values, sampling_keys);
}

}  // namespace gamer
