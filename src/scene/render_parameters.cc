#include "gamer/scene/render_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <tuple>

#include "gamer/core/near.h"
#include "gamer/core/random.h"
#include "gamer/scene/scene_columns.h"

namespace gamer {
namespace {

using Type = ParameterType;

constexpr double largest_image_side = 1e6;
constexpr double largest_supersample = 16;
constexpr double most_frames = 999999;
constexpr double largest_octaves = 32;
constexpr double largest_nside = 65536;
constexpr double most_stars_per_pixel = 1e6;
constexpr double most_field_stars = 1e8;
constexpr double largest_star_radius = 64;
constexpr double largest_h0 = 1e4;
// Galaxy radii: 2e6 steps across a galaxy.
constexpr double smallest_step = 1e-6;
// Below this sine of the angle between them, two directions count as parallel.
constexpr double smallest_sine = 1e-9;

Interval star_temperatures() { return Interval::closed(1000, 1e5); }
Interval positive() { return Interval::open(0, HUGE_VAL); }
/// Interval of pixel scales, arcsec. Rounding of directions spoils finer pixels; one pixel of the
/// largest scale shows the whole sky.
Interval pixel_scales() { return Interval::closed(1e-7, 360 * 3600); }

struct UnitName {
  PixelUnit unit;
  const char* name;
};

constexpr UnitName units[] = {
    {PixelUnit::relative, "relative"},
    {PixelUnit::nanojansky, "nJy"},
    {PixelUnit::megajansky_per_sr, "MJy/sr"},
    {PixelUnit::magnitude, "mag/arcsec^2"},
    {PixelUnit::flux_density, "erg/s/cm^2/A/arcsec^2"},
    {PixelUnit::electron_per_second, "electron/s"},
};

std::vector<std::string> unit_names() {
  std::vector<std::string> names = {"auto"};
  for (const UnitName& unit : units) names.emplace_back(unit.name);
  return names;
}

std::optional<PixelUnit> find_unit(const std::string& name) {
  for (const UnitName& unit : units) {
    if (name == unit.name) return unit.unit;
  }
  return std::nullopt;
}

struct FormatName {
  CatalogueFormat format;
  const char* name;
};

constexpr FormatName formats[] = {
    {CatalogueFormat::automatic, "auto"},
    {CatalogueFormat::list, "list"},
    {CatalogueFormat::fits, "fits"},
    {CatalogueFormat::ecsv, "ecsv"},
    {CatalogueFormat::sextractor, "sextractor"},
    {CatalogueFormat::skymaker, "skymaker"},
};

/// The format and one key for each column of a scene.
ParameterTable catalogue_table() {
  std::vector<std::string> names;
  for (const FormatName& format : formats) names.emplace_back(format.name);
  ParameterTable table = {{"format", Type::choice, "", Interval::any(), std::string("auto"),
                           "auto: as the file looks", names},
                          {"hdu",
                           Type::text,
                           "",
                           Interval::any(),
                           {},
                           "name or number of the table in a FITS file; by default the first"}};
  for (const Parameter& column : scene_columns()) {
    table.push_back({column.name,
                     Type::text,
                     "",
                     Interval::any(),
                     {},
                     fmt::format("the catalogue's column for `{0}`, or `=word` for the same in "
                                 "every row",
                                 column.name)});
  }
  return table;
}

std::vector<ParameterSection> make_sections() {
  const std::string radii = "galaxy radii";
  return {
      {"image",
       "The image and its file.",
       {{"size", Type::size2, "pixels", Interval::closed(1, largest_image_side), std::int64_t{512},
         "image size"},
        {"output", Type::text, "", Interval::any(), std::string("gamer.fits"),
         "path; the suffix decides: `.fits`, `.fits.fz` (tile-compressed), `.png`, `.bmp`"},
        {"bitpix", Type::integer, "", Interval::any(), std::int64_t{-32},
         "FITS data type, -32 or -64"},
        {"layout",
         Type::choice,
         "",
         Interval::any(),
         std::string("cube"),
         "several wavelengths: planes of one HDU, one HDU each, or one file each (name gets "
         "`_<label>`)",
         {"cube", "extensions", "files"}},
        {"unit", Type::choice, "", Interval::any(), std::string("auto"),
         "of the pixels; auto: nJy where the scene has magnitudes, else relative", unit_names()},
        {"tone",
         Type::numbers,
         "",
         Interval::any(),
         {},
         "eight numbers that set the colours of a picture: black and factor of red, green, blue, "
         "slope, scale; by default chosen from the picture itself"}}},
      {"camera",
       "The view.",
       {{"projection",
         Type::choice,
         "",
         Interval::any(),
         std::string("perspective"),
         "kind of camera",
         {"perspective", "orthographic", "sky", "fisheye", "equirectangular", "cubemap",
          "healpix"}},
        {"position", Type::vector3, "scene units", Interval::any(), std::vector<double>{0, -3, 0},
         "where the camera is"},
        {"target", Type::vector3, "scene units", Interval::any(), std::vector<double>{0, 0, 0},
         "what the middle of the image shows"},
        {"up", Type::vector3, "scene units", Interval::any(), std::vector<double>{0, 0, 1},
         "the direction that is up in the image"},
        {"fov", Type::number, "deg", Interval::left_open(0, 360), 45.0,
         "full angle across the image's width (perspective: below 180; fisheye: 180 by default)"},
        {"width", Type::number, "scene units", positive(), 2.5,
         "full width across the image (orthographic)"},
        {"nside", Type::integer, "", Interval::closed(1, largest_nside), std::int64_t{128},
         "pixels on a side of each of the twelve base pixels, a power of 2 (healpix)"},
        {"ordering",
         Type::choice,
         "",
         Interval::any(),
         std::string("ring"),
         "order of the map's pixels in the file (healpix)",
         {"ring", "nested"}},
        {"frame",
         Type::choice,
         "",
         Interval::any(),
         std::string("galactic"),
         "what longitudes and latitudes are called in the file; (0, 0) is the target, up the North "
         "pole (fisheye, equirectangular, cubemap, healpix)",
         {"galactic", "equatorial", "ecliptic"}},
        {"center", Type::vector2, "deg", Interval::any(), std::vector<double>{0, 0},
         "right ascension and declination of the image's middle (sky)"},
        {"pixel_scale", Type::number, "arcsec", pixel_scales(), 0.2, "size of a pixel there (sky)"},
        {"rotation", Type::number, "deg", Interval::any(), 0.0,
         "position angle of the image's +y, East of North (sky)"},
        {"sky_projection", Type::text, "", Interval::any(), std::string("TAN"),
         "any projection of the FITS standard by its three letters (sky)"},
        {"projection_parameters", Type::numbers, "", Interval::any(), std::vector<double>{},
         "PV2_1, PV2_2, ... of that projection (sky)"},
        {"header",
         Type::text,
         "",
         Interval::any(),
         {},
         "FITS file whose size and WCS the image takes, instead of the keys above (sky)"},
        {"supersample",
         Type::integer,
         "",
         Interval::closed(1, largest_supersample),
         {},
         "sub-pixels per side; by default 1 where the pixels are relative, else chosen by "
         "sampling.tolerance"}}},
      {"spectrum",
       "What is seen of the light.",
       {{"wavelengths", Type::numbers, "Angstrom", positive(), std::vector<double>{5500},
         "observed wavelengths, one plane each"},
        {"bands", Type::texts, "", Interval::any(), std::vector<std::string>{},
         "names or files of bandpasses in `bandpasses/`, one plane each, after the wavelengths; "
         "without wavelengths there are these only"},
        {"band_samples",
         Type::integer,
         "",
         Interval::closed(1, most_band_samples),
         {},
         "wavelengths in each band at which dust is evaluated; by default chosen by "
         "sampling.tolerance"},
        {"igm",
         Type::choice,
         "",
         Interval::any(),
         std::string("none"),
         "absorption by hydrogen between the galaxies: Madau 1995",
         {"none", "madau95"}}}},
      {"photometry",
       "What magnitudes mean, and the telescope.",
       {{"reference_band", Type::text, "", Interval::any(), std::string("sdss_r"),
         "band of the scene's magnitudes"},
        {"attenuated", Type::boolean, "", Interval::any(), false,
         "magnitudes are those of galaxies as seen with their dust"},
        {"area",
         Type::number,
         "m^2",
         positive(),
         {},
         "collecting area of the telescope, for electron/s"},
        {"throughput", Type::number, "", Interval::left_open(0, 1), 1.0,
         "of telescope and detector, besides the bandpass' own, for electron/s"}}},
      {"cosmology",
       "Flat Lambda-CDM.",
       {{"H0", Type::number, "km/s/Mpc", Interval::left_open(0, largest_h0), 70.0,
         "Hubble constant"},
        {"Omega_m", Type::number, "", Interval::closed(0, 1), 0.3, "matter density"}}},
      {"noise",
       "The procedural noise of all components.",
       {{"kind", Type::choice, "", Interval::any(), std::string("simplex"), "base noise",
         noise_names()},
        {"octaves",
         Type::integer,
         "",
         Interval::closed(1, largest_octaves),
         {},
         "omega, where a component does not say; by default that of the component's kind"},
        {"seed", Type::integer, "", Interval::closed(0, largest_seed), std::int64_t{1},
         "another number makes other galaxies of the same types"}}},
      {"sampling",
       "How rays are sampled.",
       {{"sampler",
         Type::choice,
         "",
         Interval::any(),
         std::string("adaptive"),
         "equal steps, or steps that follow the components",
         {"uniform", "adaptive"}},
        {"step", Type::number, radii, Interval::closed(smallest_step, 1), 0.01,
         "uniform sampler: step along the ray"},
        {"tolerance", Type::number, "", Interval::open(0, 1), 1e-3,
         "rms relative error over pixels above 1 % of the peak (adaptive sampler), and what is too "
         "faint to be textured"},
        {"stars_per_pixel", Type::number, "", Interval::closed(0, most_stars_per_pixel), 1.0,
         "stars of a star field that shine by themselves, expected in the pixel with the most; the "
         "others are smooth light"}}},
      {"stars",
       "Field stars all over the sky, besides the scene's, and how stars are drawn.",
       {{"number", Type::number, "1/deg^2", Interval::closed(0, most_field_stars), 0.0,
         "of field stars between the magnitudes (sky views)"},
        {"bright", Type::number, "mag", Interval::any(), 14.0,
         "of the brightest field stars, AB in photometry.reference_band"},
        {"faint", Type::number, "mag", Interval::any(), 24.0, "of the faintest"},
        {"slope", Type::number, "dex/mag", Interval::closed(-2, 2), 0.2, "dN/dm ~ 10^(slope m)"},
        {"temperature_low", Type::number, "K", star_temperatures(), 3000.0,
         "blackbodies, evenly spread in ln T"},
        {"temperature_high", Type::number, "K", star_temperatures(), 9000.0, "the hottest"},
        {"seed", Type::integer, "", Interval::closed(0, largest_seed), std::int64_t{1},
         "another number makes another sky"},
        {"antialiased", Type::boolean, "", Interval::any(), true,
         "points are shared among the four nearest pixels, so that they stand where they are; "
         "false "
         "puts each into one"},
        {"white_point",
         Type::number,
         "",
         positive(),
         {},
         "for pictures: a star whose pixel would be brighter than this (in the image's unit) is a "
         "disc of this brightness; without it all stars are points"},
        {"largest_radius", Type::number, "pixels", Interval::closed(1, largest_star_radius), 8.0,
         "of such discs; beyond it they are brighter"}}},
      {"scene",
       "The scene list.",
       {{"unit",
         Type::choice,
         "",
         Interval::any(),
         std::string("arbitrary"),
         "of positions and sizes",
         {"arbitrary", "pc", "kpc", "Mpc"}}}},
      {"catalogue", "How a catalogue is read as a scene.", catalogue_table()},
      {"animation",
       "A film: numbered images of a moving camera.",
       {{"frames",
         Type::integer,
         "",
         Interval::closed(1, most_frames),
         {},
         "number of images; the first shows the first key frame, the last the last"},
        {"times",
         Type::numbers,
         "",
         Interval::any(),
         {},
         "of the key frames, ascending, in any unit; by default 0, 1, 2..."},
        {"position",
         Type::numbers,
         "scene units",
         Interval::any(),
         {},
         "camera.position in each key frame, one after another: x, y, z, x, y, z..."},
        {"target",
         Type::numbers,
         "scene units",
         Interval::any(),
         {},
         "camera.target in each key frame"},
        {"up",
         Type::numbers,
         "scene units",
         Interval::any(),
         {},
         "camera.up in each key frame; without it camera.up holds all the time"},
        {"fov",
         Type::numbers,
         "deg",
         Interval::left_open(0, 360),
         {},
         "camera.fov in each key frame"},
        {"width", Type::numbers, "scene units", positive(), {}, "camera.width in each key frame"},
        {"tone_frame",
         Type::integer,
         "",
         Interval::closed(1, most_frames),
         {},
         "the frame that image.tone of pictures is chosen from, for all frames; by default 1"}}},
      {"truth",
       "Images of what the scene is made of, written beside the image with --truth.",
       {{"parts",
         Type::choice,
         "",
         Interval::any(),
         std::string("none"),
         "the light of each object, or of each component of it, as it is seen",
         {"none", "objects", "components"}},
        {"dust_free", Type::boolean, "", Interval::any(), false, "the image without dust"},
        {"optical_depth", Type::boolean, "", Interval::any(), false,
         "optical depth through everything"},
        {"segmentation", Type::boolean, "", Interval::any(), false,
         "the object (row of the table, from 1) with most of each pixel's light, and its share"},
        {"output",
         Type::text,
         "",
         Interval::any(),
         {},
         "path; by default that of the image with _truth before the suffix"}}},
  };
}

/// A key that has a meaning only while another key of its section has one of the given values.
struct ConditionalKey {
  std::string_view section;
  std::string_view key;
  std::string_view selector;
  std::vector<std::string_view> values;
};

const std::vector<std::string_view> sphere_kinds = {"fisheye", "equirectangular", "cubemap",
                                                    "healpix"};
const std::vector<std::string_view> with_target = {"perspective",     "orthographic", "fisheye",
                                                   "equirectangular", "cubemap",      "healpix"};

const std::vector<ConditionalKey> conditional_keys = {
    {"camera", "position", "projection", with_target},
    {"camera", "target", "projection", with_target},
    {"camera", "up", "projection", with_target},
    {"camera", "fov", "projection", {"perspective", "fisheye"}},
    {"camera", "width", "projection", {"orthographic"}},
    {"camera", "nside", "projection", {"healpix"}},
    {"camera", "ordering", "projection", {"healpix"}},
    {"camera", "frame", "projection", sphere_kinds},
    {"camera", "center", "projection", {"sky"}},
    {"camera", "pixel_scale", "projection", {"sky"}},
    {"camera", "rotation", "projection", {"sky"}},
    {"camera", "sky_projection", "projection", {"sky"}},
    {"camera", "projection_parameters", "projection", {"sky"}},
    {"camera", "header", "projection", {"sky"}},
    {"sampling", "step", "sampler", {"uniform"}},
};

/// Keys of [camera] whose values camera.header replaces.
constexpr std::string_view header_keys[] = {"center", "pixel_scale", "rotation", "sky_projection",
                                            "projection_parameters"};

const ConditionalKey* find_condition(std::string_view section, std::string_view key) {
  for (const ConditionalKey& condition : conditional_keys) {
    if (condition.section == section && condition.key == key) return &condition;
  }
  return nullptr;
}

bool is_selected(const ConditionalKey& condition, const ParameterSet& set) {
  const std::string& value = set.text(condition.selector);
  return std::find(condition.values.begin(), condition.values.end(), value) !=
         condition.values.end();
}

std::size_t index_of(std::string_view section) {
  const std::span<const ParameterSection> declared = render_parameter_sections();
  for (std::size_t i = 0; i < declared.size(); ++i) {
    if (declared[i].name == section) return i;
  }
  throw std::logic_error(fmt::format("no section [{}] is declared", section));
}

glm::dvec3 vector(const std::vector<double>& values) { return {values[0], values[1], values[2]}; }

/// Place of the first of the keys that the user gave.
SourceLocation place_of(const ParameterSet& set, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys) {
    if (set.is_given(key)) return set.where(key);
  }
  return {};
}

void check_view(const ParameterSet& camera) {
  const glm::dvec3 up = vector(camera.numbers("up"));
  const glm::dvec3 view = vector(camera.numbers("target")) - vector(camera.numbers("position"));
  const double distance = glm::length(view);
  const auto text = [&](std::string_view key) {
    return fmt::format("camera.{} = {}", key, value_text(camera.value(key)));
  };
  if (!(distance > 0)) {
    throw InputError(
        place_of(camera, {"target", "position"}),
        fmt::format("{} is camera.position: the view has no direction", text("target")));
  }
  if (!std::isfinite(distance)) {
    throw InputError(place_of(camera, {"target", "position"}),
                     fmt::format("{} is too far from {}", text("target"), text("position")));
  }
  const double length = glm::length(up);
  if (!(length > 0) || !std::isfinite(length)) {
    throw InputError(camera.where("up"), fmt::format("{} is no direction", text("up")));
  }
  if (glm::length(glm::cross(up / length, view / distance)) < smallest_sine) {
    throw InputError(place_of(camera, {"up", "target", "position"}),
                     fmt::format("{} is parallel to the view from {} to {}", text("up"),
                                 text("position"), text("target")));
  }
}

Projection find_projection(const std::string& kind) {
  constexpr std::pair<std::string_view, Projection> kinds[] = {
      {"perspective", Projection::perspective},
      {"orthographic", Projection::orthographic},
      {"sky", Projection::sky},
      {"fisheye", Projection::fisheye},
      {"cubemap", Projection::cubemap},
      {"equirectangular", Projection::equirectangular},
      {"healpix", Projection::healpix}};
  return std::ranges::find(kinds, kind, &std::pair<std::string_view, Projection>::first)->second;
}

// Default camera.fov of a fisheye, deg.
constexpr double dome = 180;
// Default size of a map of the sphere, pixels.
const std::vector<double> map_size = {1024, 512};

/// Size of the rendered image.
std::pair<int, int> resolve_size(const ParameterSet& image, const ParameterSet& camera,
                                 Projection projection) {
  const auto width = static_cast<int>(image.numbers("size")[0]);
  const auto height = static_cast<int>(image.numbers("size")[1]);
  if (projection == Projection::healpix) {
    const std::int64_t nside = camera.integer("nside");
    if ((nside & (nside - 1)) != 0) {
      throw InputError(camera.where("nside"), fmt::format("nside = {} is not a power of 2", nside));
    }
    const std::string& layout = image.text("layout");
    if (layout != "cube") {
      throw InputError(image.where("layout"),
                       fmt::format("layout = \"{}\": a HEALPix map is one table with a column per "
                                   "plane; leave layout out",
                                   layout));
    }
    return {static_cast<int>(nside), 12 * static_cast<int>(nside)};
  }
  if (projection == Projection::cubemap) {
    if (width != height) {
      throw InputError(image.where("size"),
                       fmt::format("size = {} x {}: the sides of a cube are squares; give one "
                                   "number",
                                   width, height));
    }
    return {width, 6 * height};
  }
  return {width, height};
}

void check_field_stars(const ParameterSet& stars, Projection projection) {
  if (projection != Projection::sky) {
    throw InputError(stars.where("number"),
                     "stars.number belongs to camera.projection = \"sky\": the other views have no "
                     "sky behind the scene");
  }
  const auto check_order = [&](const char* low, const char* high) {
    if (stars.number(low) < stars.number(high)) return;
    throw InputError(place_of(stars, {high, low}),
                     fmt::format("stars.{} = {} is not above stars.{} = {}", high,
                                 stars.number(high), low, stars.number(low)));
  };
  check_order("bright", "faint");
  check_order("temperature_low", "temperature_high");
}

void check_planes(const ParameterSet& spectrum) {
  std::vector<double> sorted = spectrum.numbers("wavelengths");
  const SourceLocation where = spectrum.where("wavelengths");
  std::vector<std::string> bands = spectrum.texts("bands");
  if (sorted.empty() && bands.empty()) {
    throw InputError(where,
                     "wavelengths is empty; give one wavelength (Angstrom) or more, or bands");
  }
  std::sort(bands.begin(), bands.end());
  const auto twice = std::adjacent_find(bands.begin(), bands.end());
  if (twice != bands.end()) {
    throw InputError(spectrum.where("bands"), fmt::format("bands has {} twice", in_quotes(*twice)));
  }
  std::sort(sorted.begin(), sorted.end());
  const auto repeated = std::adjacent_find(sorted.begin(), sorted.end());
  if (repeated != sorted.end()) {
    throw InputError(where, fmt::format("wavelengths has {} A twice", *repeated));
  }
}

}  // namespace

std::span<const ParameterSection> render_parameter_sections() {
  static const std::vector<ParameterSection> sections = make_sections();
  return sections;
}

RenderParameters::RenderParameters() {
  for (const ParameterSection& section : render_parameter_sections()) {
    sections_.emplace_back(section.table);
  }
  resolve();
}

RenderParameters RenderParameters::read(const ConfigNode& root) {
  const std::span<const ParameterSection> declared = render_parameter_sections();
  std::vector<std::string> names;
  for (const ParameterSection& section : declared) names.push_back(section.name);

  RenderParameters result;
  for (const auto& [name, node] : root.table()) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      const std::string what =
          node.is_table() ? fmt::format("unknown section [{}]", name)
                          : fmt::format("unknown key {} outside of a section", in_quotes(name));
      throw InputError(node.key_where, what + did_you_mean(name, names));
    }
    if (!node.is_table()) {
      throw InputError(node.where, fmt::format("{} must be a section [{}], not {}", name, name,
                                               node.type_name()));
    }
    const auto index = static_cast<std::size_t>(found - names.begin());
    result.sections_[index] =
        ParameterSet::read(declared[index].table, node, "", fmt::format("in [{}]", name));
  }
  for (const ConditionalKey& condition : conditional_keys) {
    const ParameterSet& set = result.section(condition.section);
    if (set.is_given(condition.key) && !is_selected(condition, set)) {
      throw InputError(
          set.where(condition.key),
          fmt::format("{0}.{1} belongs to {2} = \"{3}\", but {2} is \"{4}\"", condition.section,
                      condition.key, condition.selector, fmt::join(condition.values, "\" or \""),
                      set.text(condition.selector)));
    }
  }
  result.set_view_defaults();
  const ParameterSet& camera = result.section("camera");
  if (camera.is_given("header")) {
    for (const std::string_view key : header_keys) {
      if (!camera.is_given(key)) continue;
      throw InputError(camera.where(key),
                       fmt::format("camera.header gives camera.{} too; give one of them", key));
    }
  }
  result.resolve();
  return result;
}

void RenderParameters::set_view_defaults() {
  ParameterSet& image = sections_[index_of("image")];
  ParameterSet& camera = sections_[index_of("camera")];
  const std::string& kind = camera.text("projection");
  if (kind == "fisheye" && !camera.is_given("fov")) camera.set("fov", dome);
  if (kind == "equirectangular" && !image.is_given("size")) image.set("size", map_size);
  if (kind != "healpix" || !image.is_given("size")) return;
  const auto is_from_command_line = [](const SourceLocation& where) {
    return where.file.starts_with("--set ");
  };
  // A file made for another view may give a size, which the command line cannot remove.
  if (is_from_command_line(camera.where("projection")) &&
      !is_from_command_line(image.where("size"))) {
    return;
  }
  throw InputError(image.where("size"),
                   fmt::format("image.size belongs to other projections; camera.nside sets the "
                               "size of a HEALPix map, {}: leave image.size out",
                               camera.is_given("nside")
                                   ? fmt::format("here {}", camera.integer("nside"))
                                   : fmt::format("by default {}", camera.integer("nside"))));
}

void RenderParameters::set(std::string_view section_name, std::string_view key,
                           const ParameterValue& value) {
  sections_[index_of(section_name)].set(key, value);
  resolve();
}

void RenderParameters::set(const std::vector<Setting>& settings) {
  for (const Setting& setting : settings) {
    sections_[index_of(setting.section)].set(setting.key, setting.value);
  }
  resolve();
}

const ParameterSet& RenderParameters::section(std::string_view name) const {
  return sections_[index_of(name)];
}

bool RenderParameters::applies(std::string_view section_name, std::string_view key) const {
  const ParameterSet& set = section(section_name);
  if (section_name == "camera" && set.has("header") &&
      std::find(std::begin(header_keys), std::end(header_keys), key) != std::end(header_keys)) {
    return false;
  }
  if (section_name == "image" && key == "size") return projection != Projection::healpix;
  if (section_name == "animation") return frames > 0;
  // These keys say how all stars are drawn; the other keys are about field stars.
  if (section_name == "stars" && key != "antialiased" && key != "white_point" &&
      key != "largest_radius") {
    return set.number("number") > 0;
  }
  if (section_name == "spectrum" && key == "wavelengths") return !wavelengths.empty();
  const ConditionalKey* condition = find_condition(section_name, key);
  return condition == nullptr || is_selected(*condition, set);
}

std::string RenderParameters::toml() const {
  std::string result;
  for (const ParameterSection& declared : render_parameter_sections()) {
    std::string keys;
    const ParameterSet& values = section(declared.name);
    for (const Parameter& parameter : declared.table) {
      if (!values.has(parameter.name) || !applies(declared.name, parameter.name)) continue;
      keys += fmt::format("{} = {}\n", parameter.name, value_text(values.value(parameter.name)));
    }
    if (keys.empty()) continue;
    result += fmt::format("{}[{}]\n{}", result.empty() ? "" : "\n", declared.name, keys);
  }
  return result;
}

void RenderParameters::resolve() {
  const ParameterSet& image = section("image");
  projection = find_projection(section("camera").text("projection"));
  std::tie(width, height) = resolve_size(image, section("camera"), projection);
  output.path = image.text("output");
  output.bitpix = static_cast<int>(image.integer("bitpix"));
  if (output.bitpix != -32 && output.bitpix != -64) {
    throw InputError(image.where("bitpix"),
                     fmt::format("bitpix = {} is neither -32 nor -64", output.bitpix));
  }
  const std::string& layout = image.text("layout");
  output.layout = layout == "cube"         ? ImageLayout::cube
                  : layout == "extensions" ? ImageLayout::extensions
                                           : ImageLayout::files;

  output.tone.reset();
  if (image.has("tone")) {
    const std::vector<double>& numbers = image.numbers("tone");
    output.tone.emplace();
    if (numbers.size() != output.tone->size()) {
      throw InputError(image.where("tone"), fmt::format("tone has {} numbers, not {}",
                                                        numbers.size(), output.tone->size()));
    }
    std::ranges::copy(numbers, output.tone->begin());
  }

  pixel_unit = find_unit(image.text("unit"));
  pixel_unit_where = image.where("unit");

  const ParameterSet& camera = section("camera");
  if (projection != Projection::sky) check_view(camera);
  position = vector(camera.numbers("position"));
  target = vector(camera.numbers("target"));
  up = vector(camera.numbers("up"));
  fov = camera.number("fov");
  if (projection == Projection::perspective && !(fov < 180)) {
    throw InputError(camera.where("fov"),
                     fmt::format("fov = {} is outside ]0, 180[ (deg) of a perspective view; "
                                 "projection = \"fisheye\" shows more",
                                 fov));
  }
  const std::string& frame_name = camera.text("frame");
  frame = frame_name == "galactic"     ? SphereFrame::galactic
          : frame_name == "equatorial" ? SphereFrame::equatorial
                                       : SphereFrame::ecliptic;
  is_nested = camera.text("ordering") == "nested";
  camera_width = camera.number("width");
  const std::vector<double>& center = camera.numbers("center");
  if (std::abs(center[1]) > 90) {
    throw InputError(camera.where("center"),
                     fmt::format("center = {}: the declination is outside [-90, 90] (deg)",
                                 value_text(camera.value("center"))));
  }
  sky.projection = camera.text("sky_projection");
  sky.parameters = camera.numbers("projection_parameters");
  sky.center = {center[0], center[1]};
  sky.pixel_scale = camera.number("pixel_scale");
  sky.rotation = camera.number("rotation");
  sky_header = camera.has("header") ? camera.text("header") : "";
  sky_header_where = camera.where("header");
  supersample.reset();
  if (camera.has("supersample")) supersample = static_cast<int>(camera.integer("supersample"));

  const ParameterSet& spectrum = section("spectrum");
  check_planes(spectrum);
  bands = spectrum.texts("bands");
  bands_where = spectrum.where("bands");
  wavelengths = spectrum.numbers("wavelengths");
  wavelengths_where = spectrum.where("wavelengths");
  if (!bands.empty() && !spectrum.is_given("wavelengths")) wavelengths.clear();
  band_samples.reset();
  if (spectrum.has("band_samples")) {
    band_samples = static_cast<int>(spectrum.integer("band_samples"));
  }
  igm = spectrum.text("igm") == "madau95" ? Igm::madau95 : Igm::none;

  const ParameterSet& photometry = section("photometry");
  reference_band = photometry.text("reference_band");
  reference_band_where = photometry.where("reference_band");
  attenuated = photometry.boolean("attenuated");
  telescope_area = photometry.has("area") ? photometry.number("area") : 0.0;
  throughput = photometry.number("throughput");
  if (pixel_unit == PixelUnit::electron_per_second) {
    if (telescope_area == 0) {
      throw InputError(pixel_unit_where,
                       "unit = \"electron/s\" needs photometry.area, the telescope's collecting "
                       "area (m^2)");
    }
    if (!wavelengths.empty()) {
      throw InputError(pixel_unit_where,
                       "unit = \"electron/s\" needs spectrum.bands alone: no electrons come from "
                       "a single wavelength");
    }
  }
  const ParameterSet& expansion = section("cosmology");
  cosmology = Cosmology(expansion.number("H0"), expansion.number("Omega_m"));

  const ParameterSet& noise_values = section("noise");
  noise = &find_noise(noise_values.text("kind"));
  octaves.reset();
  if (noise_values.has("octaves")) octaves = static_cast<int>(noise_values.integer("octaves"));
  seed = static_cast<std::uint64_t>(noise_values.integer("seed"));

  const ParameterSet& sampling = section("sampling");
  sampler = sampling.text("sampler") == "uniform" ? SamplerKind::uniform : SamplerKind::adaptive;
  step = sampling.number("step");
  tolerance = sampling.number("tolerance");
  stars_per_pixel = sampling.number("stars_per_pixel");

  const ParameterSet& stars = section("stars");
  field_stars = {stars.number("number"),
                 stars.number("bright"),
                 stars.number("faint"),
                 stars.number("slope"),
                 stars.number("temperature_low"),
                 stars.number("temperature_high"),
                 static_cast<std::uint64_t>(stars.integer("seed")),
                 stars.where("number")};
  if (field_stars.number > 0) check_field_stars(stars, projection);
  antialiased_stars = stars.boolean("antialiased");
  white_point.reset();
  if (stars.has("white_point")) white_point = stars.number("white_point");
  largest_star = stars.number("largest_radius");

  const std::string& scene_unit = section("scene").text("unit");
  unit = scene_unit == "arbitrary" ? "" : scene_unit;

  const ParameterSet& catalogue = section("catalogue");
  for (const FormatName& format : formats) {
    if (catalogue.text("format") == format.name) catalogue_format = format.format;
  }
  catalogue_hdu = catalogue.has("hdu") ? catalogue.text("hdu") : "";
  catalogue_columns.clear();
  for (const Parameter& column : scene_columns()) {
    if (catalogue.has(column.name)) {
      catalogue_columns[column.name] = catalogue.text(column.name);
    }
  }

  const ParameterSet& animation = section("animation");
  frames = animation.has("frames") ? static_cast<int>(animation.integer("frames")) : 0;
  tone_frame = 1;
  if (animation.has("tone_frame")) {
    tone_frame = static_cast<int>(animation.integer("tone_frame"));
    if (tone_frame > frames) {
      throw InputError(
          animation.where("tone_frame"),
          fmt::format("tone_frame = {} is beyond the last frame, {}", tone_frame, frames));
    }
  }
  for (const Parameter& parameter : animation.table()) {
    if (frames == 0 && animation.is_given(parameter.name) && animation.has(parameter.name)) {
      throw InputError(animation.where(parameter.name),
                       fmt::format("animation.{} needs animation.frames", parameter.name));
    }
  }

  const ParameterSet& wanted = section("truth");
  const std::string& parts = wanted.text("parts");
  truth.parts = parts == "objects"      ? TruthImages::Parts::objects
                : parts == "components" ? TruthImages::Parts::components
                                        : TruthImages::Parts::none;
  truth.dust_free = wanted.boolean("dust_free");
  truth.optical_depth = wanted.boolean("optical_depth");
  truth.segmentation = wanted.boolean("segmentation");
  truth_path = wanted.has("output") ? wanted.text("output") : "";
}

std::optional<double> RenderParameters::megaparsec() const {
  if (projection == Projection::sky) return 1.0;
  if (unit == "pc") return 1e-6;
  if (unit == "kpc") return 1e-3;
  if (unit == "Mpc") return 1.0;
  return std::nullopt;
}

}  // namespace gamer
