#include "studio/document.h"

#include "core/message.h"
#include "gamer/core/version.h"
#include "gamer/job/look.h"
#include "gamer/job/record.h"
#include "gamer/scene/galaxy_library.h"
#include "studio/declarations.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// The document of `gamer look GALAXY` without seeing. Its texts call the galaxy by its bare name.
OpenedDocument open_galaxy(const StudioOptions& options, const Session& session) {
  Resources resources(session.folders());
  const std::string given = options.galaxy.string();
  const Resources::Text galaxy = resources.find("galaxies", given, "", galaxy_suffixes());
  OpenedDocument document;
  document.is_look = true;
  const std::string name = fs::path(galaxy.label).stem().string();
  // The page adds seeing itself. It also shows maps of the whole sphere, which allow no seeing.
  add_look({.galaxy = name, .has_seeing = false}, {}, resources);
  document.texts.parameters = resources.recorded(recorded_parameters)->content;
  document.texts.scene = resources.recorded(recorded_scene)->content;
  document.texts.galaxies[name] = galaxy.content;
  document.texts.chosen = name;
  // A galaxy that was found by its bare name comes from the data folders and is not the user's own.
  const fs::path file = galaxy.label;
  const bool is_own = given.find('/') != std::string::npos || fs::exists(options.galaxy);
  if (is_own) document.files[name] = file;
  document.label = (is_own ? file.parent_path() / "gamer look" : fs::path("gamer look")).string();
  return document;
}

OpenedDocument open_scene(const StudioOptions& options, const Session& session) {
  JobRequest request;
  request.parameters = options.parameters;
  request.scene = options.scene;
  const RenderJob job = session.load(request);
  Resources files(std::vector<fs::path>{});
  OpenedDocument document;
  document.label = options.scene.generic_string();
  document.texts.parameters = files.read("parameters", options.parameters).content;
  document.texts.scene = files.read("scene", options.scene).content;
  const fs::path folder = options.scene.parent_path();
  for (const Resources::Text& text : job.record) {
    constexpr std::string_view prefix = "galaxies/";
    if (!text.name.starts_with(prefix)) continue;
    const fs::path file = text.label;
    const std::string name = file.stem().string();
    document.texts.galaxies[name] = text.content;
    if (file.parent_path() == folder) document.files[name] = file;
  }
  if (!job.scene->galaxies.empty()) {
    document.texts.chosen = name_of_type(job.scene->galaxies.front().type);
  }
  return document;
}

/// The name of the scene's file, where it is a list that can be edited; else null.
Json scene_file(const OpenedDocument& document) {
  if (document.is_look) return nullptr;
  try {
    edit_scene(document.texts.scene, {}, document.label);
  } catch (const InputError&) {
    return nullptr;
  }
  return document.options.scene.filename().string();
}

}  // namespace

OpenedDocument open_document(const StudioOptions& options, const Session& session) {
  OpenedDocument document =
      options.galaxy.empty() ? open_scene(options, session) : open_galaxy(options, session);
  document.options = options;
  std::size_t bytes = document.texts.parameters.size() + document.texts.scene.size();
  for (const auto& [name, text] : document.texts.galaxies) bytes += text.size();
  // A quarter of a message is left for its other members and for escaped characters of the texts.
  if (bytes > most_message_bytes / 4 * 3) {
    throw input_error(SourceLocation{document.label, 0, 0},
                      "parameters, scene and galaxies together have {} bytes; the page "
                      "takes {}: a part of the scene, perhaps",
                      bytes, most_message_bytes / 4 * 3);
  }
  return document;
}

RenderParameters parameters_of(const PageDocument& document, const std::string& label,
                               const std::vector<fs::path>& folders) {
  Resources resources(folders);
  resources.add({recorded_parameters, label, document.parameters});
  JobRequest request;
  request.settings = document.settings;
  return load_parameters(request, resources);
}

Json document_json(const OpenedDocument& document, const Session& session) {
  const RenderParameters parameters =
      parameters_of(document.texts, document.label, session.folders());
  Json values = Json::object(), given = Json::array(), camera = Json::object();
  for (const ParameterSection& section : render_parameter_sections()) {
    const ParameterSet& set = parameters.section(section.name);
    add_values(set, section.name + ".", values);
    for (const Parameter& parameter : section.table) {
      if (set.is_given(parameter.name)) given.push_back(section.name + "." + parameter.name);
    }
  }
  add_values(parameters.section("camera"), "", camera);
  Json files = Json::array();
  for (const auto& [name, file] : document.files) files.push_back(name);
  return {{"op", "document"},
          {"version", version()},
          {"parameters", document.texts.parameters},
          {"scene", document.texts.scene},
          {"galaxies", document.texts.galaxies},
          {"own", files},
          {"scene_file", scene_file(document)},
          {"chosen", document.texts.chosen},
          {"camera", camera},
          {"values", values},
          {"given", given},
          {"declarations", declarations_json()},
          {"catalogue", catalogue_json(Resources(session.folders()))}};
}

}  // namespace gamer
