#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "gamer/job/session.h"
#include "gamer/studio/studio.h"
#include "studio/message.h"

namespace gamer {

/// The document that the program was started with.
struct OpenedDocument {
  std::string label;  ///< the scene's file; other files are searched beside it
  PageDocument texts;
  std::map<std::string, std::filesystem::path> files;  ///< files of the user's own galaxies
  bool is_look = false;                                ///< one galaxy without a scene
  StudioOptions options;
};

/// Reads the files of the options. Throws InputError.
OpenedDocument open_document(const StudioOptions& options, const Session& session);

/// The render parameters of a document. Throws InputError.
RenderParameters parameters_of(const PageDocument& document, const std::string& label,
                               const std::vector<std::filesystem::path>& folders);

/// The answer to "open", without its id and the outputs.
nlohmann::json document_json(const OpenedDocument& document, const Session& session);

}  // namespace gamer
