#include "studio/job_files.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <system_error>

#include "core/message.h"
#include "image/temporary_file.h"
#include "studio/output_folder.h"

namespace gamer {
namespace {

namespace fs = std::filesystem;

constexpr const char* source_parameters = "scene.par";
constexpr const char* source_scene = "scene.lst";

void make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw run_error("cannot make the folder '{}': {}", folder.string(), error.message());
}

bool sets(const std::vector<std::string>& settings, const char* key) {
  return std::ranges::any_of(settings, [&](const auto& one) { return one.starts_with(key); });
}

/// Settings of `gamer look`, which leaves its bands out where wavelengths are given.
std::vector<std::string> look_settings(const OpenedDocument& opened, const PageDocument& document) {
  std::vector<std::string> settings = document.settings;
  if (!opened.is_look || sets(settings, "spectrum.bands") ||
      !sets(settings, "spectrum.wavelengths")) {
    return settings;
  }
  const RenderParameters parameters = parameters_of(document, opened.label, {});
  settings.push_back("spectrum.bands=" + value_text(parameters.section("spectrum").value("bands")));
  return settings;
}

/// Copies the files beside the scene that a document names. In the record of a job a name of the
/// catalogue has no path ("seds/E"), but a file beside the scene has one ("seds/./mine.sed").
void write_neighbours(const Session& session, const std::string& label,
                      const PageDocument& document, const fs::path& folder) {
  const RenderInput input{document.parameters, RenderInput::Text{document.scene}, document.galaxies,
                          document.settings, label};
  const fs::path beside = fs::path(label).parent_path();
  for (const Resources::Text& text : session.load(input).record) {
    const std::size_t kind = text.name.find('/');
    if (kind == std::string::npos || text.name.find('/', kind + 1) == std::string::npos) continue;
    const fs::path place = fs::path(text.label).lexically_relative(beside.empty() ? "." : beside);
    if (place.empty() || *place.begin() == "..") continue;
    const fs::path copy = folder / place;
    make_folder(copy.parent_path());
    write_text(copy, text.content, true);
  }
}

}  // namespace

std::vector<std::string> unsaved_texts(const OpenedDocument& opened, const PageDocument& document) {
  std::vector<std::string> names;
  if (document.parameters != opened.texts.parameters) names.push_back("parameters");
  if (document.scene != opened.texts.scene) names.push_back("scene");
  for (const auto& [name, text] : document.galaxies) {
    const auto known = opened.texts.galaxies.find(name);
    if (known == opened.texts.galaxies.end() || known->second != text) names.push_back(name);
  }
  return names;
}

std::vector<std::string> job_words(const OpenedDocument& opened, const PageDocument& document,
                                   const std::string& output, const std::string& sources) {
  std::vector<std::string> words = {"gamer"};
  if (!sources.empty()) {
    words.push_back((fs::path(sources) / source_parameters).string());
    words.push_back((fs::path(sources) / source_scene).string());
  } else if (opened.is_look) {
    words.insert(words.end(), {"look", opened.options.galaxy.string()});
  } else {
    words.push_back(opened.options.parameters.string());
    words.push_back(opened.options.scene.string());
  }
  if (!output.empty()) words.insert(words.end(), {"-o", output});
  for (const std::string& setting :
       sources.empty() ? look_settings(opened, document) : document.settings) {
    words.insert(words.end(), {"-s", setting});
  }
  return words;
}

void write_sources(const Session& session, const std::string& label, const PageDocument& document,
                   const fs::path& folder) {
  write_neighbours(session, label, document, folder);
  make_folder(folder);
  write_text(folder / source_parameters, document.parameters, true);
  write_text(folder / source_scene, document.scene, true);
  for (const auto& [name, text] : document.galaxies) {
    if (!OutputFolder::is_name(name)) {
      throw input_error("galaxy '{}' has a name that no file here may have", name);
    }
    write_text(folder / (name + ".toml"), text, true);
  }
}

void write_text(const fs::path& path, const std::string& text, bool overwrite) {
  TemporaryFile file(path);
  std::ofstream stream(file.path(), std::ios::binary);
  stream.write(text.data(), static_cast<std::streamsize>(text.size()));
  stream.close();
  if (!stream) throw run_error("'{}' cannot be written", path.string());
  file.move_to_final(overwrite);
}

std::optional<std::string> read_text(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

}  // namespace gamer
