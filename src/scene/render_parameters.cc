#include "gamer/scene/render_parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <stdexcept>

#include "gamer/core/near.h"

namespace gamer {
namespace {

using Type = ParameterType;

constexpr double largest_image_side = 1e6;
constexpr double largest_supersample = 16;
constexpr double largest_octaves = 32;
// Galaxy radii: 2e6 steps across a galaxy.
constexpr double smallest_step = 1e-6;
// 2^63, above every 64-bit integer.
constexpr double largest_seed = 0x1p63;
// Below this sine of the angle between them, two directions count as parallel.
constexpr double smallest_sine = 1e-9;

Interval positive() { return Interval::open(0, HUGE_VAL); }

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
         {"cube", "extensions", "files"}}}},
      {"camera",
       "The view.",
       {{"projection",
         Type::choice,
         "",
         Interval::any(),
         std::string("perspective"),
         "kind of camera",
         {"perspective", "orthographic"}},
        {"position", Type::vector3, "scene units", Interval::any(), std::vector<double>{0, -3, 0},
         "where the camera is"},
        {"target", Type::vector3, "scene units", Interval::any(), std::vector<double>{0, 0, 0},
         "what the middle of the image shows"},
        {"up", Type::vector3, "scene units", Interval::any(), std::vector<double>{0, 0, 1},
         "the direction that is up in the image"},
        {"fov", Type::number, "deg", Interval::open(0, 180), 45.0,
         "full angle across the image's width (perspective)"},
        {"width", Type::number, "scene units", positive(), 2.5,
         "full width across the image (orthographic)"},
        {"supersample", Type::integer, "", Interval::closed(1, largest_supersample),
         std::int64_t{1}, "sub-pixels per side"}}},
      {"spectrum",
       "What is seen of the light.",
       {{"wavelengths", Type::numbers, "Angstrom", positive(), std::vector<double>{5500},
         "observed wavelengths, one plane each"}}},
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
         "faint to be textured"}}},
      {"scene",
       "The scene list.",
       {{"unit",
         Type::choice,
         "",
         Interval::any(),
         std::string("arbitrary"),
         "of positions and sizes",
         {"arbitrary", "pc", "kpc", "Mpc"}}}},
  };
}

/// A key that has a meaning only while another key of its section has one value.
struct ConditionalKey {
  std::string_view section;
  std::string_view key;
  std::string_view selector;
  std::string_view value;
};

constexpr ConditionalKey conditional_keys[] = {
    {"camera", "fov", "projection", "perspective"},
    {"camera", "width", "projection", "orthographic"},
    {"sampling", "step", "sampler", "uniform"},
};

const ConditionalKey* find_condition(std::string_view section, std::string_view key) {
  for (const ConditionalKey& condition : conditional_keys) {
    if (condition.section == section && condition.key == key) return &condition;
  }
  return nullptr;
}

std::size_t index_of(std::string_view section) {
  const std::span<const ParameterSection> declared = render_parameter_sections();
  for (std::size_t i = 0; i < declared.size(); ++i) {
    if (declared[i].name == section) return i;
  }
  throw std::logic_error(fmt::format("no section [{}] is declared", section));
}

glm::dvec3 vector(const std::vector<double>& values) { return {values[0], values[1], values[2]}; }

/// The place of the first key that the user gave.
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

void check_wavelengths(const ParameterSet& spectrum) {
  std::vector<double> sorted = spectrum.numbers("wavelengths");
  const SourceLocation where = spectrum.where("wavelengths");
  if (sorted.empty()) {
    throw InputError(where, "wavelengths is empty; give one wavelength (Angstrom) or more");
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
    if (set.is_given(condition.key) && !result.applies(condition.section, condition.key)) {
      throw InputError(set.where(condition.key),
                       fmt::format("{0}.{1} belongs to {2} = \"{3}\", but {2} is \"{4}\"",
                                   condition.section, condition.key, condition.selector,
                                   condition.value, set.text(condition.selector)));
    }
  }
  result.resolve();
  return result;
}

void RenderParameters::set(std::string_view section_name, std::string_view key,
                           const ParameterValue& value) {
  sections_[index_of(section_name)].set(key, value);
  resolve();
}

const ParameterSet& RenderParameters::section(std::string_view name) const {
  return sections_[index_of(name)];
}

bool RenderParameters::applies(std::string_view section_name, std::string_view key) const {
  const ConditionalKey* condition = find_condition(section_name, key);
  return condition == nullptr ||
         section(section_name).text(condition->selector) == condition->value;
}

std::string RenderParameters::toml() const {
  std::string result;
  for (const ParameterSection& declared : render_parameter_sections()) {
    result += fmt::format("{}[{}]\n", result.empty() ? "" : "\n", declared.name);
    const ParameterSet& values = section(declared.name);
    for (const Parameter& parameter : declared.table) {
      if (!values.has(parameter.name) || !applies(declared.name, parameter.name)) continue;
      result += fmt::format("{} = {}\n", parameter.name, value_text(values.value(parameter.name)));
    }
  }
  return result;
}

void RenderParameters::resolve() {
  const ParameterSet& image = section("image");
  width = static_cast<int>(image.numbers("size")[0]);
  height = static_cast<int>(image.numbers("size")[1]);
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

  const ParameterSet& camera = section("camera");
  check_view(camera);
  projection = camera.text("projection") == "perspective" ? Projection::perspective
                                                          : Projection::orthographic;
  position = vector(camera.numbers("position"));
  target = vector(camera.numbers("target"));
  up = vector(camera.numbers("up"));
  fov = camera.number("fov");
  camera_width = camera.number("width");
  supersample = static_cast<int>(camera.integer("supersample"));

  const ParameterSet& spectrum = section("spectrum");
  check_wavelengths(spectrum);
  wavelengths = spectrum.numbers("wavelengths");
  wavelengths_where = spectrum.where("wavelengths");

  const ParameterSet& noise_values = section("noise");
  noise = &find_noise(noise_values.text("kind"));
  octaves.reset();
  if (noise_values.has("octaves")) octaves = static_cast<int>(noise_values.integer("octaves"));
  seed = static_cast<std::uint64_t>(noise_values.integer("seed"));

  const ParameterSet& sampling = section("sampling");
  sampler = sampling.text("sampler") == "uniform" ? SamplerKind::uniform : SamplerKind::adaptive;
  step = sampling.number("step");
  tolerance = sampling.number("tolerance");

  const std::string& scene_unit = section("scene").text("unit");
  unit = scene_unit == "arbitrary" ? "" : scene_unit;
}

}  // namespace gamer
