#include "studio/answers.h"

#include <fmt/format.h>

#include <utility>

#include "gamer/core/error.h"
#include "gamer/core/shell_word.h"
#include "studio/galaxy_text.h"
#include "studio/job_files.h"
#include "studio/model.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

/// Suffixes of images that a render may make.
const std::vector<std::string>& image_suffixes() {
  static const std::vector<std::string> suffixes = {".fits", ".fits.fz", ".png", ".bmp"};
  return suffixes;
}

std::string shell_text(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + shell_word(word);
  return text;
}

/// The name of the folder with the texts of a render: that of its file without suffix.
std::string sources_name(const std::string& output) {
  return output.substr(0, output.find('.')) + ".sources";
}

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

Json Answers::operator()(const EditRequest& request) const {
  if (!request.is_galaxy) {
    return {{"op", "edited"},
            {"parameters", edit_text(request.text, request.edits, document_.label)}};
  }
  std::string text = edit_text(request.text, request.edits, galaxy_label_);
  Json model = (*this)(ModelRequest{text})["model"];
  return {{"op", "edited"}, {"galaxy_text", std::move(text)}, {"model", std::move(model)}};
}

Json Answers::operator()(const ModelRequest& request) const {
  paths_.check_text(request.text);
  return {{"op", "model"}, {"model", model_json(request.text, galaxy_label_, session_.folders())}};
}

Json Answers::operator()(const SaveRequest& request) {
  // A file that no program reads would be of no use.
  (*this)(ModelRequest{request.text});
  return request.is_own ? save_own(request) : save_as(request);
}

Json Answers::save_own(const SaveRequest& request) {
  const auto file = document_.files.find(request.galaxy);
  if (file == document_.files.end()) {
    throw InputError(
        fmt::format("'{}' is a galaxy of the catalogue, which stays as it is; save it "
                    "under another name",
                    request.galaxy));
  }
  const std::optional<std::string> now = read_text(file->second);
  std::string& known = document_.texts.galaxies[request.galaxy];
  if (now && *now != known && *now != request.text && !request.overwrite) {
    throw InputError(
        fmt::format("'{}' was changed by another program since it was opened; save "
                    "under another name",
                    file->second.string()));
  }
  write_text(file->second, request.text, true);
  known = request.text;
  return {{"op", "saved"}, {"galaxy", request.galaxy}, {"file", file->second.filename().string()}};
}

Json Answers::save_as(const SaveRequest& request) const {
  const std::string suffix = ".toml";
  const std::string name =
      request.galaxy.ends_with(suffix) ? request.galaxy : request.galaxy + suffix;
  const fs::path path = folder_.place(name, {suffix});
  if (!request.overwrite && fs::exists(fs::symlink_status(path))) {
    throw InputError(fmt::format("'{}' exists already", name));
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
          {"command", shell_text(words)},
          {"unsaved", unsaved_texts(document_, request.document)}};
}

std::vector<std::string> Answers::prepare(const RenderRequest& request) const {
  paths_.check(request.document);
  const fs::path output = folder_.place(request.name, image_suffixes());
  std::string sources;
  if (!unsaved_texts(document_, request.document).empty()) {
    sources = (document_.options.folder / sources_name(request.name)).string();
    write_sources(request.document, sources);
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
