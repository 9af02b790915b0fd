#include "gamer/job/attenuation.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "gamer/core/random.h"
#include "gamer/render/galaxy_measure.h"
#include "gamer/render/spectral_basis.h"

namespace gamer {
namespace {

// Distance of the rays of galaxies that are not measured by those of the image, relative to these.
constexpr double ray_distance = 1.5;

void append(double number, std::string& text) { text += fmt::format(" {:a}", number); }
void append(const glm::dvec3& vector, std::string& text) {
  for (int i = 0; i < 3; ++i) append(vector[i], text);
}

/// Two independent words make equal digests of different texts unlikely beyond any use.
std::string digest(const std::string& text) {
  return fmt::format("{:016x}{:016x}", hash_text(1, text), hash_text(2, text));
}

/// Names of attenuations: digests of all that decides them.
class AttenuationNames {
 public:
  AttenuationNames(const RenderParameters& parameters, const Camera& camera,
                   const Bandpass& reference);
  std::string name(const PlacedGalaxy& probe) const;

 private:
  /// Appends the light of an SED in the band, and the extinction there.
  void append_light(const Sed& sed, double redshift, std::string& text) const;

  const Camera& camera_;
  Sed::Range band_;
  std::vector<double> wavelengths_;  ///< of the band's quadrature
  std::string common_;               ///< what all galaxies share
  std::string pixels_;               ///< the places of the image's pixels in the sky
};

AttenuationNames::AttenuationNames(const RenderParameters& parameters, const Camera& camera,
                                   const Bandpass& reference)
    : camera_(camera), band_(reference.range()) {
  const Bandpass::Nodes nodes = reference.nodes();
  wavelengths_ = nodes.wavelength;
  common_ = reference.name();
  for (const double number : nodes.wavelength) append(number, common_);
  for (const double number : nodes.weight) append(number, common_);
  append(parameters.sampling.tolerance, common_);
  append(camera.right(), common_);
  const Camera whole = camera.with_window({0, 0, camera.width(), camera.height()});
  if (camera.projection() == Projection::sky) {
    pixels_ = fmt::format("{} {} ", camera.width(), camera.height());
    for (const std::string& record : whole.wcs_records()) pixels_ += record;
    pixels_ = digest(pixels_);
  }
  for (const ParameterSection& section : render_parameter_sections()) {
    // A stamp has a view and images of its own.
    if (section.name == "image" || section.name == "camera" || section.name == "truth") continue;
    const ParameterSet& values = parameters.section(section.name);
    for (const Parameter& parameter : section.table) {
      common_ += parameter.name + '=';
      if (values.has(parameter.name)) common_ += value_text(values.value(parameter.name));
      common_ += '\n';
    }
  }
  common_ = digest(common_);
}

void AttenuationNames::append_light(const Sed& sed, double redshift, std::string& text) const {
  text += sed.name();
  const Sed::Range range = sed.range();
  for (const double wavelength : {band_.low, band_.high}) {
    append(sed.flux(std::clamp(wavelength / (1 + redshift), range.low, range.high)), text);
  }
  const auto kinks = sed.kinks();
  const auto first = std::ranges::lower_bound(kinks, band_.low / (1 + redshift));
  const auto last = std::upper_bound(first, kinks.end(), band_.high / (1 + redshift));
  for (auto kink = first; kink != last; ++kink) {
    append(*kink, text);
    append(sed.flux(*kink), text);
  }
}

std::string AttenuationNames::name(const PlacedGalaxy& probe) const {
  std::string text = common_ + probe.galaxy->shape();
  if (probe.has_fixed_flux) text += pixels_;
  append(camera_.towards(probe.centre), text);
  append(camera_.up_at(probe.centre), text);
  append(probe.centre, text);
  append(probe.pole, text);
  for (int i = 0; i < 3; ++i) append(probe.to_ball[i], text);
  for (const double number : {probe.radius, probe.bounding_radius, probe.magnification,
                              probe.source_stretch, probe.redshift, probe.brightness}) {
    append(number, text);
  }
  for (const auto& component : probe.galaxy->components()) {
    append(component->amplitude(), text);
    if (component->sed() != nullptr) append_light(*component->sed(), probe.redshift, text);
    if (!component->absorbs()) continue;
    for (const double wavelength : wavelengths_) {
      append(SpectralBasis::extinction(*component->extinction(), probe.redshift, wavelength), text);
    }
  }
  return "attenuation " + digest(text);
}

}  // namespace

ObservedLight observed_light(const PlacedGalaxy& placed, const RenderParameters& parameters,
                             const Camera& camera, PixelUnit unit, bool is_draft) {
  if (unit == PixelUnit::relative ||
      !parameters.photometry.attenuated.value_or(!placed.is_absolute)) {
    return ObservedLight::none;
  }
  bool emits = false, has_dust = false, has_texture = false;
  for (const auto& component : placed.galaxy->components()) {
    emits = emits || !component->absorbs();
    has_dust = has_dust || component->absorbs();
    has_texture = has_texture || component->texture() != nullptr;
  }
  if (!emits || (!has_dust && !has_texture)) return ObservedLight::none;
  if (!is_draft && can_fix_flux(placed, parameters, camera)) return ObservedLight::rays;
  return has_dust ? ObservedLight::dust : ObservedLight::none;
}

FootprintRange attenuation_footprints(const RenderParameters& parameters) {
  return measure_footprints(parameters, ray_distance);
}

void apply_attenuation(const RenderParameters& parameters, const Camera& camera,
                       const Bandpass& reference, bool is_draft, const Ranks& ranks, int threads,
                       Scene& scene, CalibrationMemory* memory) {
  Spectrum band;
  band.planes = {
      {reference.name(), reference.pivot(), std::make_shared<const Bandpass>(reference)}};
  band.igm = parameters.spectrum.igm;
  std::vector<PlacedGalaxy*> observed;
  for (PlacedGalaxy& placed : scene.galaxies) {
    const ObservedLight light = observed_light(placed, parameters, camera, scene.unit, is_draft);
    if (light == ObservedLight::none) continue;
    placed.has_fixed_flux = light == ObservedLight::rays;
    observed.push_back(&placed);
  }
  const AttenuationNames names(parameters, camera, reference);
  const auto attenuation = [&](const PlacedGalaxy& probe, double& value) {
    const std::string name = memory != nullptr ? names.name(probe) : "";
    if (memory != nullptr && memory->recall(name, {&value, 1})) return;
    value = measure(probe, parameters, camera, band, ray_distance).attenuation.front();
    if (memory != nullptr) memory->keep(name, {&value, 1});
  };
  const auto count = static_cast<int>(observed.size());
  constexpr int blocks_per_thread = 16;
  const int block = std::max(1, count / (blocks_per_thread * ranks.size() * threads));
  const std::vector<double> seen = ranks.compute_together(
      even_blocks(count, block), 1, threads, [&](RowRange rows, std::span<double> values) {
        for (int row = rows.first; row < rows.last; ++row) {
          PlacedGalaxy galaxy = *observed[static_cast<std::size_t>(row)];
          if (galaxy.is_absolute) galaxy.redshift = 0;
          attenuation(galaxy, values[static_cast<std::size_t>(row - rows.first)]);
        }
      });
  for (std::size_t row = 0; row < observed.size(); ++row) {
    if (seen[row] > 0) observed[row]->brightness /= seen[row];
  }
}

}  // namespace gamer
