#include "gamer/render/job.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "gamer/core/version.h"
#include "gamer/image/fits.h"
#include "gamer/render/renderer.h"
#include "gamer/scene/word_table.h"
#include "image/memory.h"

namespace gamer {
namespace {

// Names in the record.
const std::string parameters_name = "render.par";
const std::string scene_name = "scene.lst";

const std::filesystem::path& source_of(const JobRequest& request,
                                       const std::filesystem::path& file) {
  return request.from_header.empty() ? file : request.from_header;
}

/// Files that the command line names: the message begins with the name.
const Resources::Text& read_file(Resources& resources, const std::string& name,
                                 const std::filesystem::path& path) {
  try {
    return resources.read(name, path);
  } catch (const InputError& error) {
    throw InputError({path.generic_string(), 0, 0}, error.what());
  }
}

void make_preview(RenderParameters& parameters) {
  const auto reduced = [](int size) {
    return static_cast<double>((size + preview_reduction - 1) / preview_reduction);
  };
  parameters.set("image", "size",
                 std::vector<double>{reduced(parameters.width), reduced(parameters.height)});
  parameters.set("camera", "supersample", std::int64_t{1});
  parameters.set("sampling", "tolerance", std::max(parameters.tolerance, preview_tolerance));
}

void set_output(const std::filesystem::path& path, RenderParameters& parameters) {
  parameters.set("image", "output", path.string());
  try {
    // The record holds TOML, which is UTF-8.
    parse_toml(parameters.toml(), "");
  } catch (const InputError&) {
    throw InputError({"--output", 0, 0}, "the name of the file is not valid UTF-8");
  }
}

RenderJob make_job(RenderParameters parameters, const Resources::Text& scene_text,
                   Resources& resources) {
  const Camera camera(parameters);
  auto scene = std::make_shared<const Scene>(
      read_scene(scene_text.content, scene_text.label, parameters, camera, resources));
  return {std::move(parameters), camera, std::move(scene), {}};
}

std::string upper(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  }
  return result;
}

Card parameter_card(const std::string& section, const Parameter& parameter,
                    const ParameterValue& value) {
  Card card;
  card.key = fmt::format("HIERARCH GAMER {} {}", upper(section), upper(parameter.name));
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

std::vector<Card> make_cards(const RenderParameters& parameters) {
  std::vector<Card> cards = {
      {"CREATOR", fmt::format("gamer {}", version()), "program and version"},
      // Cards of their own: a long one would be broken within a word.
      {"COMMENT", {}, "relative surface brightness: integral of the emissivity along the ray,"},
      {"COMMENT", {}, "lengths in galaxy radii; f_lambda per unit wavelength, SEDs normalised"},
      {"COMMENT", {}, "to 1 at 5500 Angstrom"},
  };
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

const Resources::Text& find_text(const Record& record, const std::string& name) {
  const auto found = std::find_if(record.begin(), record.end(),
                                  [&](const Resources::Text& text) { return text.name == name; });
  if (found == record.end()) throw InputError(fmt::format("the record holds no '{}'", name));
  return *found;
}

TextTable scene_table(const Resources::Text& text) {
  const WordTable words = WordTable::parse(text.content, text.label);
  TextTable table;
  table.name = "SCENE";
  for (const WordTable::Word& word : words.header()) table.columns.emplace_back(word.text);
  table.rows.reserve(words.rows());
  for (std::size_t i = 0; i < words.rows(); ++i) {
    std::vector<std::string>& row = table.rows.emplace_back();
    for (const WordTable::Word& word : words.row(i)) row.emplace_back(word.text);
  }
  return table;
}

}  // namespace

Resources open_resources(const JobRequest& request,
                         const std::vector<std::filesystem::path>& folders) {
  if (request.from_header.empty()) return Resources(folders);
  const TextTable table = read_fits_table(request.from_header, record_table_name);
  try {
    return Resources::from_record(record_from_table(table));
  } catch (const InputError& error) {
    throw InputError({request.from_header.generic_string(), 0, 0}, error.what());
  }
}

RenderParameters load_parameters(const JobRequest& request, Resources& resources) {
  const Resources::Text& text =
      read_file(resources, parameters_name, source_of(request, request.parameters));
  ConfigNode root = parse_toml(text.content, text.label);
  for (const std::string& setting : request.settings) set_from_text(root, setting);
  RenderParameters parameters = RenderParameters::read(root);
  if (request.output) set_output(*request.output, parameters);
  if (request.preview) make_preview(parameters);
  parameters.output.overwrite = request.overwrite;
  return parameters;
}

RenderJob load_job(const JobRequest& request, Resources& resources) {
  RenderParameters parameters = load_parameters(request, resources);
  const Resources::Text& scene =
      read_file(resources, scene_name, source_of(request, request.scene));
  RenderJob job = make_job(std::move(parameters), scene, resources);
  job.record = resources.record();
  for (Resources::Text& text : job.record) {
    if (text.name == parameters_name) text.content = job.parameters.toml();
  }
  return job;
}

RenderJob job_from_record(const Record& record) {
  Resources resources = Resources::from_record(record);
  const Resources::Text& text = find_text(record, parameters_name);
  RenderJob job = make_job(RenderParameters::read(parse_toml(text.content, text.label)),
                           find_text(record, scene_name), resources);
  job.record = record;
  return job;
}

ImageHeader make_image_header(const RenderJob& job) {
  ImageHeader header;
  header.width = job.camera.width();
  header.height = job.camera.height();
  header.x = job.camera.x_axis();
  header.y = job.camera.y_axis();
  header.wavelengths = job.parameters.wavelengths;
  for (const double wavelength : header.wavelengths) {
    header.labels.push_back(fmt::format("{}A", wavelength));
  }
  header.cards = make_cards(job.parameters);
  header.tables = {scene_table(find_text(job.record, scene_name)), record_table(job.record)};
  return header;
}

void check_row_memory(const ImageHeader& header, int workers) {
  const std::uint64_t needed = static_cast<std::uint64_t>(workers) *
                               static_cast<std::uint64_t>(block_rows(header.height, workers)) *
                               static_cast<std::uint64_t>(header.planes()) *
                               static_cast<std::uint64_t>(header.width) * sizeof(double);
  const std::uint64_t available = available_memory();
  if (needed <= available) return;
  throw InputError(
      fmt::format("the rows of an image of {} x {} pixels and {} planes in {} workers need {} of "
                  "memory; there are {}",
                  header.width, header.height, header.planes(), workers, bytes_text(needed),
                  bytes_text(available)));
}

}  // namespace gamer
