#pragma once

#include <string>
#include <vector>

#include "studio/document.h"

namespace gamer {

/// The names of texts of a document that differ from their files: "parameters", "scene" and
/// galaxies.
std::vector<std::string> unsaved_texts(const OpenedDocument& opened, const PageDocument& document);

/// The command line that renders a document into a file: `gamer` and its arguments. Without
/// `sources` it names the files that the program was started with, else a parameter file and a
/// scene of that folder.
std::vector<std::string> job_words(const OpenedDocument& opened, const PageDocument& document,
                                   const std::string& output, const std::string& sources);

/// Writes the texts of a document into a folder, as job_words() names them. With them go copies of
/// the spectra, bands and galaxies that they name and that lie in the folder of `label`, or below
/// it. Throws InputError and RunError.
void write_sources(const Session& session, const std::string& label, const PageDocument& document,
                   const std::filesystem::path& folder);

/// Writes a file that appears only when it is complete. Throws RunError.
void write_text(const std::filesystem::path& path, const std::string& text, bool overwrite);

/// The text of a file; nothing where it cannot be read.
std::optional<std::string> read_text(const std::filesystem::path& path);

}  // namespace gamer
