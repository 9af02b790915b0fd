#include "gamer/scene/render_parameters.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <stdexcept>
#include <tuple>

#include "core/message.h"
#include "gamer/core/near.h"
#include "image/image_suffix.h"

namespace gamer {

bool KeyCondition::holds(const ParameterSet& section) const {
  return std::ranges::count(values, section.text(selector)) > 0;
}

std::span<const ParameterSection> render_parameter_sections() {
  static const std::vector<ParameterSection> sections = {
      ImageSettings::section(),      CameraSettings::section(),    SpectrumSettings::section(),
      PhotometrySettings::section(), CosmologySettings::section(), NoiseSettings::section(),
      SamplingSettings::section(),   StarSettings::section(),      SceneSettings::section(),
      CatalogueSettings::section(),  AnimationSettings::section(), TruthSettings::section(),
      StampSettings::section()};
  return sections;
}

namespace {

std::size_t section_index(std::string_view section) {
  const std::span<const ParameterSection> declared = render_parameter_sections();
  for (std::size_t i = 0; i < declared.size(); ++i) {
    if (declared[i].name == section) return i;
  }
  throw std::logic_error(fmt::format("no section [{}] is declared", section));
}

// Section of a parameter file whose keys go to scene.overrides.
constexpr const char* galaxy_section = "galaxy";
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
      throw input_error(camera.where("nside"), "nside = {} is not a power of 2", nside);
    }
    const std::string& layout = image.text("layout");
    if (layout != "cube") {
      throw input_error(
          image.where("layout"),
          "layout = \"{}\": a HEALPix map is one table with a column per plane; leave layout out",
          layout);
    }
    return {static_cast<int>(nside), 12 * static_cast<int>(nside)};
  }
  if (projection == Projection::cubemap) {
    if (width != height) {
      throw input_error(image.where("size"),
                        "size = {} x {}: the sides of a cube are squares; give one number", width,
                        height);
    }
    return {width, 6 * height};
  }
  return {width, height};
}

/// Throws InputError where electrons are asked for without a telescope or without bands.
void check_electrons(const RenderParameters& parameters) {
  const ImageSettings& image = parameters.image;
  if (image.unit != PixelUnit::electron_per_second) return;
  if (parameters.photometry.area == 0) {
    throw InputError(image.unit_where,
                     "unit = \"electron/s\" needs photometry.area, the telescope's collecting "
                     "area (m^2)");
  }
  if (!parameters.spectrum.wavelengths.empty()) {
    throw InputError(image.unit_where,
                     "unit = \"electron/s\" needs spectrum.bands alone: no electrons come from "
                     "a single wavelength");
  }
}

/// Throws InputError for a region of a view of the sphere.
void check_region(const RenderParameters& parameters) {
  if (!parameters.image.region || !is_sphere(parameters.camera.projection)) return;
  throw input_error(parameters.section("image").where("region"),
                    "region belongs to camera.projection = \"perspective\" or \"orthographic\" or "
                    "\"sky\", but projection is \"{}\"",
                    parameters.section("camera").text("projection"));
}

bool is_picture(const RenderParameters& parameters) {
  const std::optional<ImageSuffix> suffix = image_suffix(parameters.image.output.path);
  return suffix == ImageSuffix::png || suffix == ImageSuffix::bmp;
}

/// Throws InputError for seeing that a picture cannot have.
void check_seeing(const RenderParameters& parameters) {
  const double seeing = parameters.image.output.style.seeing;
  if (seeing == 0) return;
  const SourceLocation& where = parameters.section("image").where("seeing");
  if (seeing < PictureStyle::least_seeing) {
    throw input_error(where, "seeing = {} is below {} pixels; 0 shows the pixels as they are",
                      seeing, PictureStyle::least_seeing);
  }
  if (parameters.image.unit == PixelUnit::magnitude) {
    throw InputError(where, "seeing needs a unit of light, but image.unit is a magnitude");
  }
  // Neighbouring pixels may be far apart on the sky.
  const Projection projection = parameters.camera.projection;
  if (is_sphere(projection) && projection != Projection::fisheye) {
    throw input_error(where,
                      "seeing belongs to camera.projection = \"perspective\", \"orthographic\", "
                      "\"sky\" or \"fisheye\", but projection is \"{}\"",
                      parameters.section("camera").text("projection"));
  }
}

/// Throws InputError where discs of stars would need the white of a picture that is not there.
void check_star_discs(const RenderParameters& parameters) {
  const StarSettings& stars = parameters.stars;
  if (!stars.discs.value_or(false) || stars.white_point) return;
  const auto fail = [&](const std::string& reason) {
    throw input_error(parameters.section("stars").where("discs"),
                      "discs = true: {}; give stars.white_point", reason);
  };
  if (parameters.image.unit == PixelUnit::magnitude) fail("a picture of magnitudes has no white");
  if (is_picture(parameters)) return;
  if (parameters.image.output.layout == ImageLayout::stamps) fail("stamps have no common white");
  if (parameters.image.region) fail("a region does not know the white of the whole image");
  if (parameters.animation.frames > 0 && !parameters.image.output.tone) {
    fail("frames would differ in their white");
  }
}

/// Throws InputError where stamps are combined with a setting that excludes them.
void check_stamps(const RenderParameters& parameters) {
  if (parameters.image.output.layout != ImageLayout::stamps) return;
  const auto fail = [&](const std::string& reason) {
    throw InputError(parameters.image.layout_where, "layout = \"stamps\": " + reason);
  };
  if (parameters.camera.projection != Projection::sky) {
    fail(fmt::format("stamps belong to camera.projection = \"sky\", but projection is \"{}\"",
                     parameters.section("camera").text("projection")));
  }
  if (parameters.image.region) fail("stamps have places of their own; leave image.region out");
  if (parameters.stars.field.number > 0) {
    fail("stamps show the catalogue's objects; leave stars.number out");
  }
}

}  // namespace

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
  const ConfigNode* galaxies = root.find(galaxy_section);
  names.emplace_back(galaxy_section);
  for (const auto& [name, node] : root.table()) {
    if (name == galaxy_section) continue;
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      const std::string what =
          node.is_table() ? fmt::format("unknown section [{}]", name)
                          : fmt::format("unknown key {} outside of a section", in_quotes(name));
      throw InputError(node.key_where, what + did_you_mean(name, names));
    }
    if (!node.is_table()) {
      throw input_error(node.where, "{} must be a section [{}], not {}", name, name,
                        node.type_name());
    }
    const auto index = static_cast<std::size_t>(found - names.begin());
    result.sections_[index] =
        ParameterSet::read(declared[index].table, node, "", fmt::format("in [{}]", name));
  }
  for (std::size_t i = 0; i < declared.size(); ++i) {
    const ParameterSet& set = result.sections_[i];
    for (const KeyCondition& condition : declared[i].conditions) {
      if (!set.is_given(condition.key) || condition.holds(set)) continue;
      throw input_error(set.where(condition.key),
                        "{0}.{1} belongs to {2} = \"{3}\", but {2} is \"{4}\"", declared[i].name,
                        condition.key, condition.selector, fmt::join(condition.values, "\" or \""),
                        set.text(condition.selector));
    }
  }
  if (galaxies != nullptr) result.add_overrides(*galaxies);
  result.set_view_defaults();
  const ParameterSet& camera = result.section("camera");
  if (camera.is_given("header")) {
    for (const std::string_view key : CameraSettings::header_keys()) {
      if (!camera.is_given(key)) continue;
      throw input_error(camera.where(key), "camera.header gives camera.{} too; give one of them",
                        key);
    }
  }
  result.resolve();
  return result;
}

void RenderParameters::add_overrides(const ConfigNode& galaxies) {
  if (!galaxies.is_table()) {
    throw input_error(galaxies.where, "{0} must be a section [{0}.TYPE.COMPONENT], not {1}",
                      galaxy_section, galaxies.type_name());
  }
  ParameterSet& scene_values = sections_[section_index("scene")];
  std::vector<std::string> overrides = scene_values.texts("overrides");
  std::ranges::copy(assignments(galaxies), std::back_inserter(overrides));
  scene_values.set("overrides", overrides);
}

void RenderParameters::set_view_defaults() {
  ParameterSet& image_values = sections_[section_index("image")];
  ParameterSet& camera_values = sections_[section_index("camera")];
  const std::string& kind = camera_values.text("projection");
  if (kind == "fisheye" && !camera_values.is_given("fov")) camera_values.set("fov", dome);
  if (kind == "equirectangular" && !image_values.is_given("size"))
    image_values.set("size", map_size);
  if (kind != "healpix" || !image_values.is_given("size")) return;
  const auto is_from_command_line = [](const SourceLocation& where) {
    return where.file.starts_with("--set ");
  };
  // A file for another view may give a size, which the command line cannot remove.
  if (is_from_command_line(camera_values.where("projection")) &&
      !is_from_command_line(image_values.where("size"))) {
    return;
  }
  throw input_error(image_values.where("size"),
                    "image.size belongs to other projections; camera.nside sets the size of a "
                    "HEALPix map, {}: leave image.size out",
                    camera_values.is_given("nside")
                        ? fmt::format("here {}", camera_values.integer("nside"))
                        : fmt::format("by default {}", camera_values.integer("nside")));
}

void RenderParameters::set(std::string_view section_name, std::string_view key,
                           const ParameterValue& value) {
  sections_[section_index(section_name)].set(key, value);
  resolve();
}

void RenderParameters::set(const std::vector<Setting>& settings) {
  for (const Setting& setting : settings) {
    sections_[section_index(setting.section)].set(setting.key, setting.value);
  }
  resolve();
}

const ParameterSet& RenderParameters::section(std::string_view name) const {
  return sections_[section_index(name)];
}

bool RenderParameters::applies(std::string_view section_name, std::string_view key) const {
  const ParameterSet& set = section(section_name);
  if (section_name == "camera" && set.has("header") &&
      std::ranges::count(CameraSettings::header_keys(), key) > 0) {
    return false;
  }
  if (section_name == "image" && key == "region") return image.region.has_value();
  if (section_name == "image" && key == "size") return camera.projection != Projection::healpix;
  if (section_name == "stamps") return image.output.layout == ImageLayout::stamps;
  if (section_name == "animation") return animation.frames > 0;
  if (section_name == "stars" && key == "table") return stars.table;
  // These keys say how all stars are drawn; the other keys are about field stars.
  constexpr std::array<std::string_view, 6> drawing = {"antialiased",    "discs", "white_point",
                                                       "largest_radius", "halo",  "spikes"};
  if (section_name == "stars" && std::ranges::count(drawing, key) == 0) {
    return set.number("number") > 0;
  }
  if (section_name == "spectrum" && key == "wavelengths") return !spectrum.wavelengths.empty();
  const auto& conditions = render_parameter_sections()[section_index(section_name)].conditions;
  return std::ranges::all_of(conditions, [&](const KeyCondition& condition) {
    return condition.key != key || condition.holds(set);
  });
}

bool RenderParameters::draws_star_discs() const {
  const bool is_sharp_picture = is_picture(*this) && image.output.style.seeing == 0;
  return stars.discs.value_or(is_sharp_picture || stars.white_point);
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
  camera = CameraSettings::read(section("camera"));
  std::tie(width, height) = resolve_size(section("image"), section("camera"), camera.projection);
  const bool overwrite = image.output.overwrite;  // The command line's, not the file's.
  image = ImageSettings::read(section("image"));
  image.output.overwrite = overwrite;
  check_region(*this);
  spectrum = SpectrumSettings::read(section("spectrum"));
  photometry = PhotometrySettings::read(section("photometry"));
  check_electrons(*this);
  cosmology = CosmologySettings::read(section("cosmology"));
  noise = NoiseSettings::read(section("noise"));
  sampling = SamplingSettings::read(section("sampling"));
  const auto tone = stars.tone;  // Measured, not read.
  stars = StarSettings::read(section("stars"));
  stars.tone = tone;
  if (!is_picture(*this)) image.output.style.seeing = 0;
  check_seeing(*this);
  // Discs of stars have spikes of their own.
  image.output.style.spikes = draws_star_discs() ? 0 : stars.spikes;
  if (stars.field.number > 0 && camera.projection != Projection::sky) {
    throw InputError(stars.field.number_where,
                     "stars.number belongs to camera.projection = \"sky\": the other views have no "
                     "sky behind the scene");
  }
  scene = SceneSettings::read(section("scene"));
  catalogue = CatalogueSettings::read(section("catalogue"));
  animation = AnimationSettings::read(section("animation"));
  truth = TruthSettings::read(section("truth"));
  stamps = StampSettings::read(section("stamps"));
  check_stamps(*this);
  check_star_discs(*this);
}

std::optional<double> RenderParameters::megaparsec() const {
  return camera.projection == Projection::sky ? 1.0 : scene.megaparsec();
}

}  // namespace gamer
