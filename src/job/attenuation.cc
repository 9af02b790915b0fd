#include "gamer/job/attenuation.h"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gamer/core/digest.h"
#include "gamer/job/calibration_cache.h"
#include "gamer/render/galaxy_measure.h"
#include "gamer/render/spectral_basis.h"

namespace gamer {
namespace {

// `ray_distance` of measure() for galaxies without fixed flux.
constexpr double ray_distance = 1.5;

void append_hex(double number, std::string& text) { text += fmt::format(" {:a}", number); }
void append_hex(const glm::dvec3& vector, std::string& text) {
  for (int i = 0; i < 3; ++i) append_hex(vector[i], text);
}

/// Names of attenuations: digests of all that decides them.
class AttenuationNames {
 public:
  /// `planes` are those in which galaxies of fixed flux are measured, with `spectral_nodes`.
  AttenuationNames(const RenderParameters& parameters, const Camera& camera,
                   const Bandpass& reference, const Spectrum& planes,
                   std::vector<double> spectral_nodes);
  std::string name(const PlacedGalaxy& probe) const;

 private:
  /// The light that decides an attenuation: a range of the spectra, and wavelengths at which dust
  /// is sampled.
  struct Light {
    Sed::Range range;
    std::vector<double> wavelengths;
  };
  /// Appends the light of an SED in a range.
  static void append_light(const Sed& sed, double redshift, const Sed::Range& range,
                           std::string& text);

  const Camera& camera_;
  Light band_;          ///< of the reference band
  Light planes_;        ///< of all planes
  std::string common_;  ///< what all galaxies share
  std::string pixels_;  ///< the places of the image's pixels in the sky, and its planes
};

AttenuationNames::AttenuationNames(const RenderParameters& parameters, const Camera& camera,
                                   const Bandpass& reference, const Spectrum& planes,
                                   std::vector<double> spectral_nodes)
    : camera_(camera),
      band_{reference.range(), reference.nodes().wavelength},
      planes_{band_.range, std::move(spectral_nodes)} {
  const auto append_band = [](const Bandpass& band, std::string& text) {
    text += band.name();
    const Bandpass::Nodes nodes = band.nodes();
    for (const double number : nodes.wavelength) append_hex(number, text);
    for (const double number : nodes.weight) append_hex(number, text);
  };
  append_band(reference, common_);
  append_hex(parameters.sampling.tolerance, common_);
  append_hex(camera.right(), common_);
  const Camera whole = camera.with_window({0, 0, camera.width(), camera.height()});
  if (camera.projection() == Projection::sky) {
    pixels_ = fmt::format("{} {} ", camera.width(), camera.height());
    for (const std::string& record : whole.wcs_records()) pixels_ += record;
    for (const double node : planes_.wavelengths) append_hex(node, pixels_);
    for (const SpectralPlane& plane : planes.planes) {
      append_hex(plane.wavelength, pixels_);
      if (plane.band != nullptr) append_band(*plane.band, pixels_);
      const Sed::Range range = plane.band != nullptr
                                   ? plane.band->range()
                                   : Sed::Range{plane.wavelength, plane.wavelength};
      planes_.range = {std::min(planes_.range.low, range.low),
                       std::max(planes_.range.high, range.high)};
    }
    pixels_ = digest(pixels_);
  }
  for (const ParameterSection& section : render_parameter_sections()) {
    // The stamp on which a galaxy is measured has its own view and images.
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

void AttenuationNames::append_light(const Sed& sed, double redshift, const Sed::Range& range,
                                    std::string& text) {
  text += sed.name();
  const Sed::Range known = sed.range();
  for (const double wavelength : {range.low, range.high}) {
    append_hex(sed.flux(std::clamp(wavelength / (1 + redshift), known.low, known.high)), text);
  }
  const auto kinks = sed.kinks();
  const auto first = std::ranges::lower_bound(kinks, range.low / (1 + redshift));
  const auto last = std::upper_bound(first, kinks.end(), range.high / (1 + redshift));
  for (auto kink = first; kink != last; ++kink) {
    append_hex(*kink, text);
    append_hex(sed.flux(*kink), text);
  }
}

std::string AttenuationNames::name(const PlacedGalaxy& probe) const {
  std::string text = common_ + probe.galaxy->shape();
  const Light& light = probe.has_fixed_flux ? planes_ : band_;
  if (probe.has_fixed_flux) text += pixels_;
  append_hex(camera_.towards(probe.centre), text);
  append_hex(camera_.up_at(probe.centre), text);
  append_hex(probe.centre, text);
  append_hex(probe.pole, text);
  for (int i = 0; i < 3; ++i) append_hex(probe.to_ball[i], text);
  for (const double number : {probe.radius, probe.bounding_radius, probe.magnification,
                              probe.source_stretch, probe.redshift, probe.brightness}) {
    append_hex(number, text);
  }
  for (const auto& component : probe.galaxy->components()) {
    append_hex(component->amplitude(), text);
    // A texture may have a scale of its own or that of the galaxy's reference.
    if (component->texture() != nullptr) {
      for (const double number : component->texture()->statistics()) append_hex(number, text);
    }
    if (component->sed() != nullptr)
      append_light(*component->sed(), probe.redshift, light.range, text);
    if (!component->absorbs()) continue;
    for (const double wavelength : light.wavelengths) {
      append_hex(SpectralBasis::extinction(*component->extinction(), probe.redshift, wavelength),
                 text);
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
  if (!is_draft && can_be_layer(placed, parameters, camera)) return ObservedLight::rays;
  return has_dust ? ObservedLight::dust : ObservedLight::none;
}

void choose_drawn_stars(const RenderParameters& parameters, const Camera& camera, Scene& scene) {
  const auto is_field = [](const auto& component) { return component->star_field() != nullptr; };
  for (PlacedGalaxy& placed : scene.galaxies) {
    const bool is_smooth = !parameters.sampling.stars_per_pixel &&
                           scene.unit != PixelUnit::relative && is_small(placed, camera);
    placed.draws_stars = parameters.sampling.draws_stars() && !is_smooth &&
                         std::ranges::any_of(placed.galaxy->components(), is_field);
  }
}

void choose_layers(RenderJob& job, bool is_draft) {
  for (PlacedGalaxy& placed : job.scene->galaxies) {
    placed.is_layer = !is_draft && job.scene->unit != PixelUnit::relative &&
                      can_be_layer(placed, job.parameters, job.camera);
  }
}

FootprintRange attenuation_footprints(const RenderParameters& parameters) {
  return measure_footprints(parameters, ray_distance);
}

namespace {

// Largest memory of the layers that a rank keeps.
constexpr std::size_t most_layer_bytes = std::size_t{128} << 20;

/// A band as the only plane.
Spectrum spectrum_of(const Bandpass& band, const RenderParameters& parameters) {
  return {{{band.name(), band.pivot(), std::make_shared<const Bandpass>(band)}},
          parameters.spectrum.igm};
}

/// The place of a band among the planes; none if it is not there.
std::optional<std::size_t> plane_of(const Bandpass& band, const Spectrum& spectrum) {
  const auto found = std::ranges::find_if(spectrum.planes, [&](const SpectralPlane& plane) {
    return plane.band != nullptr && plane.band->name() == band.name() &&
           plane.band->pivot() == band.pivot();
  });
  if (found == spectrum.planes.end()) return std::nullopt;
  return static_cast<std::size_t>(found - spectrum.planes.begin());
}

/// The rays of the image through galaxies of fixed flux.
class FixedFluxes {
 public:
  FixedFluxes(const RenderParameters& parameters, const Bandpass& reference, bool truth,
              const RenderJob& job);

  /// Measures a galaxy of the scene.
  GalaxyMeasure measure(std::size_t galaxy);
  /// Light that reaches the observer in the reference band, over that without dust.
  double attenuation(const GalaxyMeasure& measured) const { return measured.attenuation[plane_]; }
  /// Whether all planes of the image are measured.
  bool has_planes() const { return has_planes_; }
  const Spectrum& spectrum() const { return spectrum_; }
  std::vector<double> spectral_nodes() const { return renderer_.spectral_nodes(); }
  const std::shared_ptr<GalaxyLayers>& layers() const { return layers_; }
  /// Counts of all rays so far.
  const RenderCounts& counts() const { return counts_; }

 private:
  static Spectrum planes(const Bandpass& reference, const RenderJob& job);
  static TruthSettings images(const RenderParameters& parameters, bool truth);

  bool has_planes_;
  std::size_t plane_;
  Spectrum spectrum_;
  const Camera& camera_;
  std::shared_ptr<const Scene> scene_;
  Renderer renderer_;
  bool has_table_;        ///< whether measures go to a table of truth
  bool drops_dust_free_;  ///< whether layers drop light without dust, which the image does not show
  std::shared_ptr<GalaxyLayers> layers_;
  std::mutex mutex_;
  RenderCounts counts_;
};

Spectrum FixedFluxes::planes(const Bandpass& reference, const RenderJob& job) {
  if (plane_of(reference, job.spectrum)) return job.spectrum;
  return spectrum_of(reference, job.parameters);
}

TruthSettings FixedFluxes::images(const RenderParameters& parameters, bool truth) {
  TruthSettings images = truth ? parameters.truth : TruthSettings();
  // Light without dust gives the factors of components.
  images.dust_free = true;
  return images;
}

FixedFluxes::FixedFluxes(const RenderParameters& parameters, const Bandpass& reference, bool truth,
                         const RenderJob& job)
    : has_planes_(plane_of(reference, job.spectrum).has_value()),
      plane_(plane_of(reference, job.spectrum).value_or(0)),
      spectrum_(planes(reference, job)),
      camera_(job.camera),
      scene_(job.scene),
      renderer_(parameters, job.camera, scene_, spectrum_, images(parameters, truth)),
      has_table_(truth && has_planes_),
      drops_dust_free_(!truth || !parameters.truth.dust_free),
      layers_(std::make_shared<GalaxyLayers>(scene_->galaxies.size(), most_layer_bytes)) {}

GalaxyMeasure FixedFluxes::measure(std::size_t galaxy) {
  const PlacedGalaxy& placed = scene_->galaxies[galaxy];
  GalaxyLayer layer;
  GalaxyMeasure result = measure_fixed(renderer_, placed, static_cast<int>(galaxy), camera_,
                                       spectrum_, has_table_, layer);
  if (has_planes_) {
    if (drops_dust_free_) layer.shorten(layer.numbers - spectrum_.planes.size());
    layers_->keep(galaxy, std::move(layer));
  }
  const std::lock_guard lock(mutex_);
  counts_ += result.counts;
  return result;
}

/// The galaxies whose magnitude includes dust. The function also decides which of them have a fixed
/// flux.
std::vector<std::size_t> find_observed(const RenderParameters& parameters, bool is_draft,
                                       RenderJob& job) {
  std::vector<std::size_t> observed;
  for (std::size_t g = 0; g < job.scene->galaxies.size(); ++g) {
    PlacedGalaxy& placed = job.scene->galaxies[g];
    const ObservedLight light =
        observed_light(placed, parameters, job.camera, job.scene->unit, is_draft);
    if (light == ObservedLight::none) continue;
    placed.has_fixed_flux = light == ObservedLight::rays;
    observed.push_back(g);
  }
  return observed;
}

/// Gives every rank the layers of all ranks, at most most_layer_bytes together. Every rank calls
/// this function.
void share_layers(const Ranks& ranks, std::size_t galaxies, GalaxyLayers& layers) {
  CalibrationParts own;
  std::size_t room = most_layer_bytes / static_cast<std::size_t>(ranks.size());
  for (std::size_t g = 0; g < galaxies; ++g) {
    const GalaxyLayer* const layer = layers.find(g);
    if (layer == nullptr) continue;
    const std::size_t bytes = layer->values.size() * sizeof(double);
    if (bytes > room) break;
    room -= bytes;
    const ImageRegion& region = layer->region;
    std::vector<double>& numbers = own[std::to_string(g)];
    numbers = {static_cast<double>(region.left), static_cast<double>(region.bottom),
               static_cast<double>(region.width), static_cast<double>(region.height),
               static_cast<double>(layer->numbers)};
    numbers.insert(numbers.end(), layer->values.begin(), layer->values.end());
  }
  CalibrationParts all;
  for (const std::string& packed : ranks.gather(pack_parts(own))) all.merge(unpack_parts(packed));
  all = unpack_parts(ranks.broadcast(ranks.rank() == 0 ? pack_parts(all) : ""));
  for (const auto& [name, numbers] : all) {
    const std::size_t g = std::stoul(name);
    if (layers.find(g) != nullptr) continue;
    const auto whole = [&](std::size_t i) { return static_cast<int>(numbers[i]); };
    constexpr std::size_t head = 5;
    layers.keep(g, {{whole(0), whole(1), whole(2), whole(3)},
                    static_cast<std::size_t>(numbers[head - 1]),
                    {numbers.begin() + head, numbers.end()}});
  }
}

/// The numbers of a measured galaxy that ranks share: its attenuation, its unconverged rays, the
/// number of its factors, and the factors. Its properties follow where the table of truth needs
/// them.
class MeasuredNumbers {
 public:
  MeasuredNumbers(const Scene& scene, std::span<const std::size_t> observed,
                  std::size_t properties);

  std::size_t size() const { return first_property_ + properties_; }
  /// The numbers of a row, among those of all rows.
  template <class Number>
  std::span<Number> of_row(std::span<Number> all, std::size_t row) const {
    return all.subspan(row * size(), size());
  }
  void write(double attenuation, const GalaxyMeasure& measured, std::span<double> numbers) const;
  /// Gives a galaxy its brightness and its factors.
  static void apply(std::span<const double> numbers, PlacedGalaxy& galaxy);
  static double unconverged_rays(std::span<const double> numbers) { return numbers[1]; }
  /// The properties, if there are any.
  std::optional<GalaxyMeasure> properties(std::span<const double> numbers) const {
    if (properties_ == 0) return std::nullopt;
    return GalaxyMeasure::unpacked(numbers.subspan(first_property_));
  }

 private:
  static constexpr std::size_t first_factor = 3;

  std::size_t first_property_ = first_factor;
  std::size_t properties_;
};

MeasuredNumbers::MeasuredNumbers(const Scene& scene, std::span<const std::size_t> observed,
                                 std::size_t properties)
    : properties_(properties) {
  std::size_t factors = 0;
  for (const std::size_t g : observed) {
    factors = std::max(factors, scene.galaxies[g].galaxy->components().size());
  }
  first_property_ += factors;
}

void MeasuredNumbers::write(double attenuation, const GalaxyMeasure& measured,
                            std::span<double> numbers) const {
  numbers[0] = attenuation;
  numbers[1] = static_cast<double>(measured.counts.unconverged_rays);
  numbers[2] = static_cast<double>(measured.light_factors.size());
  std::ranges::copy(measured.light_factors, numbers.subspan(first_factor).begin());
  if (properties_ == 0 || measured.light_factors.empty()) return;
  std::ranges::copy(measured.packed(), numbers.subspan(first_property_).begin());
}

void MeasuredNumbers::apply(std::span<const double> numbers, PlacedGalaxy& galaxy) {
  const std::span<const double> factors =
      numbers.subspan(first_factor, static_cast<std::size_t>(numbers[2]));
  galaxy.light_factors.assign(factors.begin(), factors.end());
  if (numbers[0] > 0) galaxy.brightness /= numbers[0];
}

}  // namespace

void apply_attenuation(const RenderParameters& parameters, const RenderJob::Pending& pending,
                       const Ranks& ranks, int threads, RenderJob& job, CalibrationMemory* memory) {
  const Bandpass& reference = *pending.attenuation;
  Scene& scene = *job.scene;
  const Spectrum band = spectrum_of(reference, parameters);
  const std::vector<std::size_t> observed = find_observed(parameters, pending.is_draft, job);
  // Absolute magnitudes hold at redshift 0, not in the image's planes.
  const auto is_fixed = [&](std::size_t g) {
    return scene.galaxies[g].has_fixed_flux && !scene.galaxies[g].is_absolute;
  };
  std::optional<FixedFluxes> fixed;
  const bool has_fixed = std::ranges::any_of(observed, is_fixed);
  if (has_fixed) fixed.emplace(parameters, reference, pending.truth, job);
  const AttenuationNames names(parameters, job.camera, reference, fixed ? fixed->spectrum() : band,
                               fixed ? fixed->spectral_nodes() : std::vector<double>());
  const bool has_measures = fixed && fixed->has_planes() && pending.truth;
  const MeasuredNumbers numbers(
      scene, observed, has_measures ? GalaxyMeasure::numbers(job.spectrum.planes.size()) : 0);
  const auto measure_galaxy = [&](std::size_t g, std::span<double> values) {
    PlacedGalaxy galaxy = scene.galaxies[g];
    if (galaxy.is_absolute) galaxy.redshift = 0;
    // The name differs for results with and without measured properties.
    const std::string name =
        memory != nullptr ? fmt::format("{} {}", names.name(galaxy), numbers.size()) : "";
    if (memory != nullptr && memory->recall(name, values)) return;
    const GalaxyMeasure measured =
        is_fixed(g) ? fixed->measure(g)
                    : measure(galaxy, parameters, job.camera, band, ray_distance);
    numbers.write(is_fixed(g) ? fixed->attenuation(measured) : measured.attenuation.front(),
                  measured, values);
    if (memory != nullptr) memory->keep(name, values);
  };
  const auto count = static_cast<int>(observed.size());
  constexpr int blocks_per_thread = 16;
  const int block = std::max(1, count / (blocks_per_thread * ranks.size() * threads));
  const std::vector<double> all = ranks.compute_together(
      even_blocks(count, block), numbers.size(), threads,
      [&](RowRange rows, std::span<double> values) {
        for (int row = rows.first; row < rows.last; ++row) {
          measure_galaxy(observed[static_cast<std::size_t>(row)],
                         numbers.of_row(values, static_cast<std::size_t>(row - rows.first)));
        }
      },
      [&](int more) {
        if (pending.progress) pending.progress(more, count);
      });
  if (fixed && ranks.size() > 1) share_layers(ranks, scene.galaxies.size(), *fixed->layers());
  if (fixed) {
    job.layers = fixed->layers();
    job.layer_counts = fixed->counts();
  }
  if (has_measures) job.measures.resize(scene.galaxies.size());
  for (std::size_t row = 0; row < observed.size(); ++row) {
    const std::size_t g = observed[row];
    const std::span<const double> own = numbers.of_row(std::span(all), row);
    if (has_measures && is_fixed(g)) job.measures[g] = numbers.properties(own);
    MeasuredNumbers::apply(own, scene.galaxies[g]);
    job.unconverged_rays += MeasuredNumbers::unconverged_rays(own);
  }
}

}  // namespace gamer
