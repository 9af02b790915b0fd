#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "gamer/core/error.h"
#include "studio/galaxy_text.h"
#include "studio/scene_text.h"

namespace gamer {

/// The document that the page shows and renders: texts of files, and changes to parameters.
struct PageDocument {
  std::string parameters;
  std::string scene;
  std::map<std::string, std::string> galaxies;
  std::vector<std::string> settings;  ///< "section.key=value"
  std::string chosen;                 ///< the galaxy that is worked on; empty for the first
};

/// One size of a view.
struct ViewLevel {
  int width = 0, height = 0;
  std::optional<double> tolerance;  ///< none: the scene's own
};

struct OpenRequest {};
struct EditRequest {
  std::string text;
  std::vector<TextEdit> edits;
  bool is_galaxy = true;  ///< otherwise a parameter file
};
struct EditSceneRequest {
  std::string text;
  std::vector<SceneEdit> edits;
};
/// Orientations in space for rows that have an inclination.
struct FixOrientationsRequest {
  PageDocument document;
};
/// The text of a galaxy of the catalogue.
struct GalaxyRequest {
  std::string name;
};
struct ModelRequest {
  std::string text;
};
struct ViewRequest {
  PageDocument document;
  bool wants_components = false;
  bool wants_strips = false;  ///< sends rows of large levels once they are finished; the levels'
                              ///< frames then have no rows
  std::vector<int> muted;     ///< components of the chosen galaxy, from 0
  std::vector<ViewLevel> levels;
};
struct DraftRequest {
  PageDocument document;
  std::vector<int> muted;  ///< components of the galaxy, from 0
  int size = 0;            ///< nodes in the plane
};
struct CancelRequest {
  std::optional<std::int64_t> target;  ///< a render; none: the page's view
};
struct SaveRequest {
  std::string galaxy;  ///< the name of its own file, or of a file in the folder
  std::string text;
  bool is_own = true;  ///< over its own file
  bool overwrite = false;
};
struct SaveSceneRequest {
  std::string text;
  bool overwrite = false;
};
struct CommandRequest {
  PageDocument document;
  std::string name;
};
struct RenderRequest {
  PageDocument document;
  std::string name;  ///< a file of the folder
  bool overwrite = false;
  bool resume = false;
};
struct OutputsRequest {};

struct Message {
  std::int64_t id = 0;
  std::variant<OpenRequest, EditRequest, EditSceneRequest, GalaxyRequest, ModelRequest, ViewRequest,
               CancelRequest, SaveRequest, SaveSceneRequest, CommandRequest, RenderRequest,
               OutputsRequest, DraftRequest, FixOrientationsRequest>
      request;
};

/// The error for a message that cannot be read. It has the id of the message where that could be
/// read.
class BadMessage : public InputError {
 public:
  BadMessage(std::optional<std::int64_t> id, const std::string& message)
      : InputError(message), id_(id) {}
  const std::optional<std::int64_t>& id() const { return id_; }

 private:
  std::optional<std::int64_t> id_;
};

inline constexpr std::size_t most_message_bytes = std::size_t{1} << 20;

/// Reads a message. Throws BadMessage for a text that is no JSON object, and for an unknown
/// operation or key. Other errors are a wrong type, a missing key, and numbers or lists beyond
/// limits.
Message parse_message(std::string_view text);

/// The text of an answer. Bytes that are not UTF-8 are replaced.
std::string json_text(const nlohmann::json& json);

}  // namespace gamer
