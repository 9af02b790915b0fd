#include "gamer/job/job.h"

#include <algorithm>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>

#include "core/message.h"
#include "gamer/core/capitals.h"
#include "gamer/core/units.h"
#include "gamer/core/version.h"
#include "gamer/galaxy/calibration/calibration_memory.h"
#include "gamer/galaxy/kinds/star_field.h"
#include "gamer/job/attenuation.h"
#include "gamer/job/measure_galaxies.h"
#include "gamer/job/schedule.h"
#include "gamer/job/star_table.h"
#include "gamer/job/star_tone.h"
#include "gamer/scene/catalogue.h"
#include "gamer/scene/galaxy_library.h"
#include "gamer/sed/photometry.h"
#include "image/image_suffix.h"
#include "image/memory.h"
#include "job/make_job.h"
#include "job/scene_input.h"
#include "job/scene_table.h"
#include "job/tone_view.h"

namespace gamer {
namespace {

// Names in the record.
const std::string parameters_name = recorded_parameters;
const std::string scene_name = recorded_scene;

Card parameter_card(const std::string& section, const Parameter& parameter,
                    const ParameterValue& value) {
  Card card;
  card.key = fmt::format("HIERARCH {}{} {}", record_key_stem, in_capitals(section),
                         in_capitals(parameter.name));
  if (const auto* flag = std::get_if<bool>(&value)) {
    card.value = *flag;
  } else if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    card.value = static_cast<long long>(*whole);
  } else if (const auto* real = std::get_if<double>(&value)) {
    card.value = *real;
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    card.value = *text;
  } else {
    card.value = value_text(value);
  }
  if (!parameter.unit.empty()) card.comment = fmt::format("[{}]", parameter.unit);
  return card;
}

std::vector<Card> make_cards(const RenderParameters& parameters, const Scene& scene) {
  std::vector<Card> cards = {
      {"CREATOR", fmt::format("gamer {}", version()), "program and version"},
  };
  if (scene.unit == PixelUnit::relative) {
    // Each value gets a card, since a long card would be broken within a word.
    cards.insert(
        cards.end(),
        {{"COMMENT", {}, "relative surface brightness: integral of the emissivity along the ray,"},
         {"COMMENT", {}, "lengths in galaxy radii; f_lambda per unit wavelength, SEDs normalised"},
         {"COMMENT", {}, "to 1 at 5500 Angstrom"}});
  }
  for (const ParameterSection& section : render_parameter_sections()) {
    const ParameterSet& values = parameters.section(section.name);
    for (const Parameter& parameter : section.table) {
      if (!values.has(parameter.name) || !parameters.applies(section.name, parameter.name))
        continue;
      cards.push_back(parameter_card(section.name, parameter, values.value(parameter.name)));
    }
  }
  return cards;
}

}  // namespace

std::string unit_text(PixelUnit unit) {
  switch (unit) {
    case PixelUnit::relative: return "";
    case PixelUnit::nanojansky: return "nJy";
    case PixelUnit::megajansky_per_sr: return "MJy/sr";
    case PixelUnit::magnitude: return "mag/arcsec2";
    case PixelUnit::flux_density: return "erg/(s.cm2.Angstrom.arcsec2)";
    case PixelUnit::electron_per_second: return "electron/s";
  }
  throw std::logic_error("unknown PixelUnit");
}

namespace {

/// Flux density of the value 1 of a plane, nJy. It is per pixel, or per arcsec^2 for brightnesses.
/// Relative light and magnitudes, which are not linear, have none.
std::optional<double> unit_in_nanojansky(const SpectralPlane& plane, const RenderJob& job) {
  const PixelUnit unit = job.scene->unit;
  if (unit == PixelUnit::relative || unit == PixelUnit::magnitude) return std::nullopt;
  return (counts_flux(unit) ? 1 : square_arcsecond) /
         value_of_nanojansky(plane, unit, job.parameters);
}

/// Cards with the calibration of a plane. The flux per pixel, or per arcsec^2, has m_AB = MAGZERO -
/// 2.5 log10(value). A value of 1 is PHOTFLAM erg/s/cm^2/Angstrom.
std::vector<Card> calibration_cards(const SpectralPlane& plane, const RenderJob& job) {
  std::vector<Card> cards;
  if (plane.band != nullptr) cards.push_back({"BAND", plane.label, "bandpass"});
  const PixelUnit unit = job.scene->unit;
  if (unit == PixelUnit::relative) return cards;
  cards.push_back({"PHOTPLAM", plane.wavelength, "[Angstrom] pivot wavelength"});
  const std::optional<double> unit_flux = unit_in_nanojansky(plane, job);
  if (!unit_flux) return cards;
  const bool is_flux = counts_flux(unit);
  const double zero_point = ab_magnitude(*unit_flux);
  const double f_lambda =
      nanojansky_in_cgs * speed_of_light / (plane.wavelength * plane.wavelength);
  cards.push_back({"MAGZERO", zero_point,
                   fmt::format("AB magnitude of 1 unit per {}", is_flux ? "pixel" : "arcsec2")});
  cards.push_back({"PHOTZP", zero_point, "the same"});
  cards.push_back({"PHOTFLAM", f_lambda * *unit_flux, "[erg/s/cm2/Angstrom] of 1 unit"});
  return cards;
}

/// Adds the card of that key where all planes have equal values.
void append_common_card(ImageHeader& header, const std::string& key) {
  const Card* common = nullptr;
  for (const std::vector<Card>& cards : header.plane_cards) {
    const auto found =
        std::ranges::find_if(cards, [&](const Card& card) { return card.key == key; });
    if (found == cards.end() || (common != nullptr && common->value != found->value)) return;
    common = &*found;
  }
  if (common != nullptr) header.cards.push_back(*common);
}

/// Resets the keys of [catalogue], which do not apply to the list in the record.
void forget_columns(RenderParameters& parameters) {
  std::vector<RenderParameters::Setting> settings = {{"catalogue", "hdu", std::monostate()},
                                                     {"catalogue", "format", std::string("list")},
                                                     {"catalogue", "skip_flagged", false}};
  for (const Parameter& column : scene_columns()) {
    settings.push_back({"catalogue", column.name, std::monostate()});
  }
  parameters.set(settings);
}

/// The footprints of a job's image, and of the stamps on which galaxies are measured, by galaxy. In
/// a film all footprints count, since cameras of other frames may be nearer.
std::map<const Galaxy*, FootprintRange> footprints_by_galaxy(const Scene& scene,
                                                             const RenderParameters& parameters,
                                                             const Camera& camera, bool is_draft) {
  const bool draws_stars = std::ranges::any_of(scene.galaxies, &PlacedGalaxy::draws_stars);
  const bool is_film = parameters.animation.frames > 0;
  std::map<const Galaxy*, FootprintRange> by_galaxy;
  for (const PlacedGalaxy& placed : scene.galaxies) {
    FootprintRange range;
    if (is_draft && !is_film) range = GalaxyLibrary::draft_footprints();
    if (!is_draft && !is_film) {
      range = Renderer::footprints(parameters, camera, scene.unit, placed);
      const ObservedLight light = observed_light(placed, parameters, camera, scene.unit, false);
      range.needs_light_means = light != ObservedLight::rays;
      if (light != ObservedLight::rays) range = range | measure_footprints(parameters);
      if (light == ObservedLight::dust) range = range | attenuation_footprints(parameters);
    }
    range.sees_whole = draws_stars;
    const auto [known, is_new] = by_galaxy.try_emplace(placed.galaxy.get(), range);
    if (!is_new) known->second = known->second | range;
  }
  return by_galaxy;
}

/// Adds the footprints of the view on which the tone of a picture with stars is measured.
void add_tone_footprints(const std::shared_ptr<const Scene>& scene,
                         const RenderParameters& parameters, const Camera& camera,
                         std::map<const Galaxy*, FootprintRange>& by_galaxy) {
  if (parameters.image.output.tone) return;
  const std::shared_ptr<const Scene> lit = tone_scene(camera, scene);
  const ToneView view = tone_view(parameters, camera, *lit);
  for (const PlacedGalaxy& placed : lit->galaxies) {
    FootprintRange& range = by_galaxy.at(placed.galaxy.get());
    FootprintRange seen = Renderer::footprints(view.parameters, view.camera, lit->unit, placed);
    // The view of the tone needs means of light only where the image needs them.
    seen.needs_light_means = range.needs_light_means;
    range = range | seen;
  }
}

}  // namespace

RenderJob make_job(RenderParameters parameters, const Catalogue& catalogue, Resources& resources,
                   GalaxyLibrary& library, const SharedText& list) {
  const Camera camera = make_camera(parameters, resources);
  Spectrum spectrum = load_spectrum(parameters, resources);
  const auto read = [&] {
    auto made = std::make_shared<Scene>(
        read_scene(catalogue, parameters, spectrum, camera, resources, library));
    choose_drawn_stars(parameters, camera, *made);
    return made;
  };
  std::shared_ptr<Scene> scene = read();
  const auto footprints = [&] {
    const bool is_draft = library.measures_as_draft();
    auto found = footprints_by_galaxy(*scene, parameters, camera, is_draft);
    if (!is_draft && measures_star_tone(parameters, *scene)) {
      add_tone_footprints(scene, parameters, camera, found);
    }
    return found;
  };
  std::map<const Galaxy*, FootprintRange> needed = footprints();
  if (!library.suffices(needed)) {
    scene = read();
    needed = footprints();
  }
  if (scene->list == list) scene->list = list;
  RenderJob::Pending pending{library.take_unmeasured(*scene), {}, nullptr};
  if (!needed.empty()) {
    for (const auto& galaxy : pending.galaxies) {
      pending.footprints.push_back(needed.at(galaxy.get()));
    }
  }
  pending.keep = library.keeper(pending.galaxies);
  const bool has_observed = std::ranges::any_of(scene->galaxies, [&](const auto& placed) {
    return observed_light(placed, parameters, camera, scene->unit, library.measures_as_draft()) !=
           ObservedLight::none;
  });
  pending.is_draft = library.measures_as_draft();
  pending.star_tone = measures_star_tone(parameters, *scene);
  if (has_observed) pending.attenuation = load_reference_band(parameters, resources);
  RenderJob job{std::move(parameters), camera, std::move(spectrum),
                std::move(scene),      {},     std::move(pending)};
  check_star_table(job);
  return job;
}

void complete(RenderJob& job, const Ranks& ranks, int threads, CalibrationMemory* memory) {
  const RenderJob::Pending pending = std::exchange(job.pending, {});
  measure_galaxies(pending.galaxies, pending.footprints, ranks, memory);
  if (pending.keep) pending.keep(pending.footprints);
  choose_layers(job, pending.is_draft);
  if (pending.attenuation != nullptr) {
    // Views of a galaxy at coarse tolerances share one measurement.
    const RenderParameters parameters =
        pending.is_draft ? GalaxyLibrary::draft_accuracy(job.parameters) : job.parameters;
    apply_attenuation(parameters, pending, ranks, threads, job, memory);
  }
  if (pending.star_tone) find_star_tone(job, ranks, threads);
}

Renderer image_renderer(const RenderJob& job, const TruthSettings& truth) {
  Renderer renderer(job.parameters, job.camera, job.scene, job.spectrum, truth);
  renderer.use(job.layers);
  return renderer;
}

RenderJob recorded(RenderJob job, const std::string& label, Resources& resources) {
  forget_columns(job.parameters);
  resources.add({scene_name, label, job.scene->list});
  if (job.scene->probes) {
    std::map<std::size_t, std::size_t> list_rows;
    for (const std::size_t row : job.scene->kept) list_rows.emplace(row, list_rows.size());
    resources.add({recorded_probes, label, probes_text(*job.scene->probes, list_rows)});
  }
  record_other_columns(*job.scene, job.parameters.animation.frames > 0, label, resources);
  job.record = resources.record();
  if (Resources::Text* text = find_text(job.record, parameters_name)) {
    text->content = job.parameters.toml();
  }
  return job;
}

Resources open_resources(const JobRequest& request,
                         const std::vector<std::filesystem::path>& folders) {
  if (!request.from_header.empty()) return Resources::from_record(read_record(request.from_header));
  Resources resources(folders);
  if (request.look) add_look(*request.look, request.settings, resources);
  return resources;
}

std::string mapping_text(const JobRequest& request, Resources& resources) {
  const RenderParameters parameters = load_parameters(request, resources);
  return column_mapping(read_catalogue(request, parameters, resources), parameters);
}

RenderJob read_job(const JobRequest& request, Resources& resources) {
  RenderParameters parameters = load_parameters(request, resources);
  std::string label;
  // The catalogue, which may be large, is freed before the record is made.
  const auto make = [&](const Catalogue& catalogue) {
    label = catalogue.label();
    GalaxyLibrary library(parameters, label, resources);
    return make_job(std::move(parameters), catalogue, resources, library);
  };
  RenderJob job = make(read_catalogue(request, parameters, resources));
  job.input_files = resources.files();
  return recorded(std::move(job), label, resources);
}

RenderParameters recorded_render_parameters(const Record& record) {
  const Resources::Text& text = text_of(record, parameters_name);
  return RenderParameters::read(parse_toml(text.content, text.label));
}

RenderJob read_job(const Record& record) {
  Resources resources = Resources::from_record(record);
  RenderParameters parameters = recorded_render_parameters(record);
  const Resources::Text& list = text_of(record, scene_name);
  const Catalogue catalogue =
      Catalogue::parse(list.content, list.label, parameters.catalogue.format);
  GalaxyLibrary library(parameters, list.label, resources);
  RenderJob job = make_job(std::move(parameters), catalogue, resources, library, list.content);
  job.record = record;
  return job;
}

RenderJob load_job(const JobRequest& request, Resources& resources) {
  RenderJob job = read_job(request, resources);
  complete(job, Ranks(), 1);
  return job;
}

std::vector<double> zero_points(const RenderJob& job) {
  std::vector<double> zero_points;
  for (const SpectralPlane& plane : job.spectrum.planes) {
    const std::optional<double> unit_flux = unit_in_nanojansky(plane, job);
    if (!unit_flux) return {};
    zero_points.push_back(ab_magnitude(*unit_flux));
  }
  return zero_points;
}

ImageHeader make_image_header(const RenderJob& job) {
  ImageHeader header;
  header.width = job.camera.window().width;
  header.height = job.camera.window().height;
  header.unit = unit_text(job.scene->unit);
  if (job.camera.wcs()) {
    header.wcs_records = job.camera.wcs_records();
  } else if (is_sphere(job.parameters.camera.projection)) {
    set_sphere_axes(job.parameters, header);
  } else {
    header.x = job.camera.x_axis();
    header.y = job.camera.y_axis();
  }
  for (const SpectralPlane& plane : job.spectrum.planes) {
    header.wavelengths.push_back(plane.wavelength);
    header.labels.push_back(plane.label);
    header.plane_cards.push_back(calibration_cards(plane, job));
  }
  header.cards = make_cards(job.parameters, *job.scene);
  // In a cube the calibration cards have numbered keys, but readers look for keys without a number.
  const ImageLayout layout = job.parameters.image.output.layout;
  if (header.planes() > 1 && (layout == ImageLayout::cube || layout == ImageLayout::stamps)) {
    for (const char* key : {"MAGZERO", "PHOTZP"}) append_common_card(header, key);
  }
  if (const Resources::Text* flagged = find_text(job.record, recorded_flagged)) {
    header.cards.push_back(flagged_card(flagged->content));
  }
  header.tables = {record_table(job.record)};
  // A picture keeps only what makes it again.
  const std::optional<ImageSuffix> suffix = image_suffix(job.parameters.image.output.path);
  if (suffix != ImageSuffix::png && suffix != ImageSuffix::bmp) {
    header.data_tables = {
        scene_table(*job.scene, find_text(job.record, recorded_columns), job.parameters)};
  }
  return header;
}

ImageHeader make_truth_header(const RenderJob& job) {
  ImageHeader header = make_image_header(job);
  const std::vector<double> wavelengths = std::move(header.wavelengths);
  const std::vector<std::vector<Card>> cards = std::move(header.plane_cards);
  header.wavelengths.clear();
  header.plane_cards.clear();
  header.labels.clear();
  header.tables.clear();
  header.data_tables.clear();
  for (const OutputPlane& output : output_planes(*job.scene, job.spectrum, job.parameters.truth)) {
    using Kind = OutputPlane::Kind;
    if (output.kind == Kind::image) continue;
    header.labels.push_back(output.label);
    const bool is_light = output.kind == Kind::dust_free || output.kind == Kind::object ||
                          output.kind == Kind::component;
    header.plane_units.push_back(is_light ? header.unit : "");
    std::vector<Card> plane_cards = is_light ? cards[output.plane] : std::vector<Card>();
    if (output.kind == Kind::object || output.kind == Kind::component) {
      plane_cards.push_back({"OBJECT", fmt::format("{}", output.object + 1), "row of table TRUTH"});
    }
    header.plane_cards.push_back(std::move(plane_cards));
  }
  header.unit.clear();
  return header;
}

OutputOptions truth_output(const RenderParameters& parameters) {
  OutputOptions options = parameters.image.output;
  options.layout = ImageLayout::extensions;
  if (!parameters.truth.path.empty()) {
    options.path = parameters.truth.path;
    return options;
  }
  // The suffixes .fits and .fits.fz stay; the truth of a picture is FITS too.
  std::string name = options.path.filename().string();
  const std::size_t suffix = name.find(".fits");
  const std::string end = suffix == std::string::npos ? ".fits" : name.substr(suffix);
  name = suffix == std::string::npos ? options.path.stem().string() : name.substr(0, suffix);
  options.path = options.path.parent_path() / (name + "_truth" + end);
  return options;
}

void check_row_memory(const ImageHeader& header, int planes, int ranks, int threads) {
  const std::uint64_t needed = row_memory(header.width, planes, ranks, threads);
  const std::uint64_t available = available_memory();
  if (needed <= available) return;
  throw input_error(
      "the rows of an image of {} x {} pixels and {} planes in {} thread{} need {} of memory; "
      "there are {}",
      header.width, header.height, planes, threads, threads == 1 ? "" : "s", bytes_text(needed),
      bytes_text(available));
}

}  // namespace gamer
