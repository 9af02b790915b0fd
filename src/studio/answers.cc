#include "studio/answers.h"

#include <algorithm>
#include <ranges>
#include <utility>

#include "core/message.h"
#include "gamer/core/near.h"
#include "gamer/core/shell_word.h"
#include "gamer/scene/galaxy_library.h"
#include "studio/galaxy_text.h"
#include "studio/job_files.h"
#include "studio/model.h"
#include "studio/scene_orientation.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

}  // namespace

Answers::Answers(const Session& session, OpenedDocument document)
    : session_(session),
      document_(std::move(document)),
      paths_(document_.texts),
      folder_(document_.options.folder),
      galaxy_label_((fs::path(document_.label).parent_path() / "galaxy").generic_string()) {}

Json Answers::operator()(const OpenRequest&) const {
  Json reply = document_json(document_, session_);
  reply["outputs"] = (*this)(OutputsRequest{})["outputs"];
  return reply;
}

Json Answers::operator()(const EditRequest& request) {
  if (!request.is_galaxy) {
    return {{"op", "edited"},
            {"parameters", edit_text(request.text, request.edits, document_.label)}};
  }
  std::string text = edit_text(request.text, request.edits, galaxy_label_);
  Json model = (*this)(ModelRequest{text})["model"];
  return {{"op", "edited"}, {"galaxy_text", std::move(text)}, {"model", std::move(model)}};
}

Json Answers::operator()(const EditSceneRequest& request) const {
  std::string scene = edit_scene(request.text, request.edits, document_.label);
  return {{"op", "edited"}, {"scene", std::move(scene)}};
}

Json Answers::operator()(const FixOrientationsRequest& request) const {
  paths_.check(request.document);
  return {{"op", "edited"},
          {"scene", fix_orientations(session_, document_.label, request.document)}};
}

Json Answers::operator()(const GalaxyRequest& request) {
  Resources resources(session_.folders());
  const std::vector<std::string> names = resources.names("galaxies", galaxy_suffixes());
  if (std::ranges::find(names, request.name) == names.end()) {
    throw input_error("the catalogue has no galaxy {}{}", in_quotes(request.name),
                      did_you_mean(request.name, names));
  }
  // A galaxy of the document comes before one of the catalogue.
  const auto known = document_.texts.galaxies.find(request.name);
  if (known == document_.texts.galaxies.end()) {
    const Resources::Text& text =
        resources.find("galaxies", request.name, document_.label, galaxy_suffixes());
    document_.texts.galaxies[request.name] = text.content;
  }
  return {{"op", "galaxy"},
          {"name", request.name},
          {"galaxy_text", document_.texts.galaxies[request.name]}};
}

Json Answers::operator()(const ModelRequest& request) {
  paths_.check_text(request.text);
  return {{"op", "model"},
          {"model", model_json(request.text, galaxy_label_, session_.folders(), latest_)}};
}

Json Answers::operator()(const SaveRequest& request) {
  // Throws for a text that is no galaxy.
  (*this)(ModelRequest{request.text});
  return request.is_own ? save_own(request) : save_as(request);
}

Json Answers::save_own(const SaveRequest& request) {
  const auto file = document_.files.find(request.galaxy);
  if (file == document_.files.end()) {
    throw input_error(
        "'{}' is a galaxy of the catalogue, which stays as it is; save it under another name",
        request.galaxy);
  }
  save_over(file->second, document_.texts.galaxies[request.galaxy], request.text,
            request.overwrite);
  return {{"op", "saved"}, {"galaxy", request.galaxy}, {"file", file->second.filename().string()}};
}

void Answers::save_over(const fs::path& file, std::string& known, const std::string& text,
                        bool overwrite) const {
  const std::optional<std::string> now = read_text(file);
  if (now && *now != known && *now != text && !overwrite) {
    throw input_error(
        "'{}' was changed by another program since it was opened; save under another name",
        file.string());
  }
  write_text(file, text, true);
  known = text;
}

Json Answers::operator()(const SaveSceneRequest& request) {
  const fs::path& file = document_.options.scene;
  if (document_.is_look) throw InputError("gstudio was started with a galaxy: there is no scene");
  PageDocument document = document_.texts;
  document.scene = request.text;
  paths_.check(document);
  // Throws for a text that is no list.
  edit_scene(request.text, {}, document_.label);
  save_over(file, document_.texts.scene, request.text, request.overwrite);
  return {{"op", "saved"}, {"scene", true}, {"file", file.filename().string()}};
}

Json Answers::save_as(const SaveRequest& request) const {
  const std::string suffix = ".toml";
  const std::string name =
      request.galaxy.ends_with(suffix) ? request.galaxy : request.galaxy + suffix;
  const fs::path path = folder_.place(name, {suffix});
  if (!request.overwrite && fs::exists(fs::symlink_status(path))) {
    throw input_error("'{}' exists already", name);
  }
  write_text(path, request.text, request.overwrite);
  return {{"op", "saved"}, {"file", name}, {"path", path.string()}};
}

std::string Answers::path_of_output(const std::string& name) const {
  return name.empty() ? "" : (document_.options.folder / name).string();
}

Json Answers::operator()(const CommandRequest& request) const {
  paths_.check(request.document);
  const std::vector<std::string> words =
      job_words(document_, request.document, path_of_output(request.name), "");
  return {{"op", "command"},
          {"command", fmt::format("{}", fmt::join(words | std::views::transform(shell_word), " "))},
          {"unsaved", unsaved_texts(document_, request.document)}};
}

std::vector<std::string> Answers::prepare(const RenderRequest& request) const {
  paths_.check(request.document);
  const fs::path output = folder_.place(request.name, {".fits", ".fits.fz", ".png", ".bmp"});
  std::string sources;
  if (!unsaved_texts(document_, request.document).empty()) {
    const std::string stem = request.name.substr(0, request.name.find('.'));
    sources = (document_.options.folder / (stem + ".sources")).string();
    write_sources(session_, document_.label, request.document, sources);
  }
  std::vector<std::string> words = job_words(document_, request.document, output.string(), sources);
  if (request.overwrite) words.emplace_back("--overwrite");
  if (request.resume) words.emplace_back("--resume");
  return words;
}

Json Answers::operator()(const OutputsRequest&) const {
  Json files = Json::array();
  for (const OutputFolder::Entry& entry : folder_.list()) {
    files.push_back({{"name", entry.name}, {"bytes", entry.bytes}});
  }
  return {{"op", "outputs"}, {"outputs", files}};
}

}  // namespace gamer
