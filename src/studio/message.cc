#include "studio/message.h"

#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "core/message.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

using Json = nlohmann::json;

constexpr int most_depth = 16;
constexpr std::size_t most_edits = 256, most_settings = 256, most_galaxies = 256;
constexpr std::size_t most_levels = 16, most_muted = 64;
constexpr std::size_t most_name_bytes = 200, most_setting_bytes = 4096;
constexpr int most_pixels_a_side = 16384;
constexpr int least_draft_nodes = 16, most_draft_nodes = 256;

/// Throws InputError where brackets outside of strings are nested too deep.
void check_depth(std::string_view text) {
  int depth = 0;
  bool is_string = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_string) {
      if (c == '\\') ++i;
      is_string = c != '"';
    } else if (c == '"') {
      is_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > most_depth) throw InputError("a message is nested too deep");
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
}

/// The members of an object, each taken once; what is left over is an error.
class Members {
 public:
  Members(const Json& object, std::string what) : object_(object), what_(std::move(what)) {
    if (!object.is_object()) throw InputError(what_ + " is no object");
  }

  const Json* find(const char* key) {
    known_.emplace_back(key);
    const auto found = object_.find(key);
    return found == object_.end() || found->is_null() ? nullptr : &*found;
  }
  const Json& get(const char* key) {
    const Json* member = find(key);
    if (member == nullptr) throw input_error("{} lacks '{}'", what_, key);
    return *member;
  }
  std::string text(const char* key, std::size_t most_bytes = most_message_bytes) {
    return text_of(get(key), key, most_bytes);
  }
  std::string text_or(const char* key, std::string other, std::size_t most_bytes) {
    const Json* member = find(key);
    return member == nullptr ? std::move(other) : text_of(*member, key, most_bytes);
  }
  bool flag(const char* key) {
    const Json* member = find(key);
    if (member == nullptr) return false;
    if (!member->is_boolean()) throw input_error("'{}' is true or false", key);
    return member->get<bool>();
  }
  const Json::array_t& list(const char* key, std::size_t most) {
    static const Json::array_t none;
    const Json* member = find(key);
    if (member == nullptr) return none;
    if (!member->is_array()) throw input_error("'{}' is no list", key);
    if (member->size() > most) throw input_error("'{}' has more than {} members", key, most);
    return member->get_ref<const Json::array_t&>();
  }
  /// Throws InputError for a member that nobody asked for.
  void finish() const {
    for (const auto& [key, value] : object_.items()) {
      if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
      throw input_error("{} has no {}{}", what_, in_quotes(key), did_you_mean(key, known_));
    }
  }

  static std::string text_of(const Json& member, const char* what, std::size_t most_bytes) {
    if (!member.is_string()) throw input_error("'{}' is no text", what);
    const auto& text = member.get_ref<const std::string&>();
    if (text.size() > most_bytes) {
      throw input_error("'{}' is longer than {} bytes", what, most_bytes);
    }
    if (text.find('\0') != std::string::npos) throw input_error("'{}' has NUL bytes", what);
    return text;
  }

 private:
  const Json& object_;
  std::string what_;
  std::vector<std::string> known_;
};

/// A whole number within bounds; whole floating-point numbers serve, too.
std::int64_t whole(const Json& json, const char* what, std::int64_t low, std::int64_t high) {
  std::optional<std::int64_t> number;
  if (json.is_number_unsigned()) {
    const auto value = json.get<std::uint64_t>();
    if (value <= static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
      number = static_cast<std::int64_t>(value);
    }
  } else if (json.is_number_integer()) {
    number = json.get<std::int64_t>();
  }
  if (!number || *number < low || *number > high) {
    throw input_error("'{}' is no whole number from {} to {}", what, low, high);
  }
  return *number;
}

std::optional<int> component_of(const Json& json) {
  if (json.is_null()) return std::nullopt;
  return static_cast<int>(whole(json, "component", 0, std::numeric_limits<int>::max()));
}

/// A value in TOML syntax.
std::string toml_value(const Json& json, int depth = 0) {
  constexpr int most_lists = 4;
  if (json.is_boolean()) return json.get<bool>() ? "true" : "false";
  if (json.is_string())
    return value_text(ParameterValue(Members::text_of(json, "value", most_message_bytes)));
  if (json.is_number_float()) return value_text(ParameterValue(json.get<double>()));
  if (json.is_number()) {
    const auto limit = std::numeric_limits<std::int64_t>::max();
    return fmt::format("{}", whole(json, "value", std::numeric_limits<std::int64_t>::min(), limit));
  }
  if (!json.is_array() || depth >= most_lists) {
    throw InputError("a value is a number, a text, true, false or a list of these");
  }
  std::string list;
  for (const Json& member : json)
    list += (list.empty() ? "" : ", ") + toml_value(member, depth + 1);
  return "[" + list + "]";
}

const Json::array_t& list_of(const Json& json, const char* what, std::size_t size) {
  if (!json.is_array() || json.size() != size) {
    throw input_error("'{}' is a list of {}", what, size);
  }
  return json.get_ref<const Json::array_t&>();
}

TextEdit parse_edit(const Json& json) {
  if (!json.is_object() || json.size() != 1) throw InputError("an edit is an object of one member");
  const std::string& name = json.begin().key();
  const Json& value = *json.begin();
  const auto index = [](const Json& one) {
    const std::optional<int> component = component_of(one);
    if (!component) throw InputError("an edit needs a component's number");
    return *component;
  };
  if (name == "set") {
    const auto& parts = list_of(value, "set", 3);
    return SetEdit{component_of(parts[0]), Members::text_of(parts[1], "set", most_name_bytes),
                   toml_value(parts[2])};
  }
  if (name == "reset") {
    const auto& parts = list_of(value, "reset", 2);
    return ResetEdit{component_of(parts[0]), Members::text_of(parts[1], "reset", most_name_bytes)};
  }
  if (name == "add") return AddEdit{Members::text_of(value, "add", most_name_bytes)};
  if (name == "add_arm") return AddArmEdit{};
  const bool is_arm = name.ends_with("_arm");
  const TextList list = is_arm ? TextList::arms : TextList::components;
  const std::string verb = is_arm ? name.substr(0, name.size() - 4) : name;
  if (verb == "clone") return CloneEdit{index(value), list};
  if (verb == "delete") return DeleteEdit{index(value), list};
  if (verb == "move") {
    const auto& parts = list_of(value, "move", 2);
    return MoveEdit{index(parts[0]), index(parts[1]), list};
  }
  throw input_error("there is no edit {}", in_quotes(name));
}

PageDocument document_of(Members& members) {
  PageDocument document;
  document.parameters = members.text("parameters");
  document.scene = members.text("scene");
  const Json& galaxies = members.get("galaxies");
  if (!galaxies.is_object() || galaxies.size() > most_galaxies) {
    throw input_error("'galaxies' is an object of at most {} texts", most_galaxies);
  }
  for (const auto& [name, text] : galaxies.items()) {
    document.galaxies[name] = Members::text_of(text, "galaxies", most_message_bytes);
  }
  for (const Json& setting : members.list("settings", most_settings)) {
    document.settings.push_back(Members::text_of(setting, "settings", most_setting_bytes));
  }
  document.chosen = members.text_or("chosen", "", most_name_bytes);
  return document;
}

ViewLevel level_of(const Json& json) {
  const auto& parts = list_of(json, "sizes", 3);
  ViewLevel level;
  level.width = static_cast<int>(whole(parts[0], "width", 1, most_pixels_a_side));
  level.height = static_cast<int>(whole(parts[1], "height", 1, most_pixels_a_side));
  if (parts[2].is_null()) return level;
  if (!parts[2].is_number() || !std::isfinite(parts[2].get<double>())) {
    throw InputError("a tolerance is a number");
  }
  level.tolerance = parts[2].get<double>();
  return level;
}

std::vector<int> muted_of(Members& members) {
  std::vector<int> muted;
  for (const Json& one : members.list("muted", most_muted)) {
    muted.push_back(component_of(one).value_or(0));
  }
  return muted;
}

ViewRequest parse_view(Members& members) {
  ViewRequest request;
  request.document = document_of(members);
  const std::string planes = members.text_or("planes", "image", most_name_bytes);
  if (planes != "image" && planes != "components") {
    throw InputError("'planes' is \"image\" or \"components\"");
  }
  request.wants_components = planes == "components";
  request.wants_strips = members.flag("strips");
  request.muted = muted_of(members);
  for (const Json& one : members.list("sizes", most_levels)) {
    request.levels.push_back(level_of(one));
  }
  if (request.levels.empty()) throw InputError("'sizes' is empty");
  return request;
}

EditRequest parse_edits(Members& members, const char* text, bool is_galaxy) {
  EditRequest request;
  request.text = members.text(text);
  request.is_galaxy = is_galaxy;
  for (const Json& edit : members.list("edits", most_edits)) {
    request.edits.push_back(parse_edit(edit));
  }
  return request;
}

/// A word of a list; null for none.
std::string word_of(const Json& json) {
  if (json.is_null()) return "-";
  if (json.is_string()) return Members::text_of(json, "value", most_setting_bytes);
  if (json.is_number()) return toml_value(json);
  throw InputError("a value of a row is a number, a text or null");
}

SceneEdit parse_scene_edit(const Json& json) {
  if (!json.is_object() || json.size() != 1) throw InputError("an edit is an object of one member");
  const std::string& name = json.begin().key();
  const Json& value = *json.begin();
  const auto row = [](const Json& one) {
    return static_cast<int>(whole(one, "row", 0, std::numeric_limits<int>::max()));
  };
  if (name == "set") {
    const auto& parts = list_of(value, "set", 3);
    return SetCellEdit{row(parts[0]), Members::text_of(parts[1], "set", most_name_bytes),
                       word_of(parts[2])};
  }
  if (name == "add") {
    const auto& parts = list_of(value, "add", 2);
    return AddRowEdit{row(parts[0]), Members::text_of(parts[1], "add", most_name_bytes)};
  }
  if (name == "clone") return CloneRowEdit{row(value)};
  if (name == "delete") return DeleteRowEdit{row(value)};
  throw input_error("there is no edit {}", in_quotes(name));
}

EditSceneRequest parse_scene_edits(Members& members) {
  EditSceneRequest request;
  request.text = members.text("scene");
  for (const Json& edit : members.list("edits", most_edits)) {
    request.edits.push_back(parse_scene_edit(edit));
  }
  return request;
}

using Request = decltype(Message::request);

const std::map<std::string, std::function<Request(Members&)>, std::less<>>& message_parsers() {
  static const std::map<std::string, std::function<Request(Members&)>, std::less<>> all = {
      {"open", [](Members&) -> Request { return OpenRequest{}; }},
      {"outputs", [](Members&) -> Request { return OutputsRequest{}; }},
      {"edit", [](Members& m) -> Request { return parse_edits(m, "galaxy_text", true); }},
      {"edit_parameters",
       [](Members& m) -> Request { return parse_edits(m, "parameters", false); }},
      {"edit_scene", [](Members& m) -> Request { return parse_scene_edits(m); }},
      {"fix_orientations",
       [](Members& m) -> Request { return FixOrientationsRequest{document_of(m)}; }},
      {"galaxy",
       [](Members& m) -> Request { return GalaxyRequest{m.text("galaxy", most_name_bytes)}; }},
      {"save_scene",
       [](Members& m) -> Request {
         return SaveSceneRequest{m.text("scene"), m.flag("overwrite")};
       }},
      {"model", [](Members& m) -> Request { return ModelRequest{m.text("galaxy_text")}; }},
      {"view", [](Members& m) -> Request { return parse_view(m); }},
      {"draft",
       [](Members& m) -> Request {
         return DraftRequest{
             document_of(m), muted_of(m),
             static_cast<int>(whole(m.get("size"), "size", least_draft_nodes, most_draft_nodes))};
       }},
      {"cancel",
       [](Members& m) -> Request {
         CancelRequest request;
         if (const Json* target = m.find("target")) {
           request.target = whole(*target, "target", std::numeric_limits<std::int64_t>::min(),
                                  std::numeric_limits<std::int64_t>::max());
         }
         return request;
       }},
      {"save",
       [](Members& m) -> Request {
         return SaveRequest{m.text("galaxy", most_name_bytes), m.text("galaxy_text"), true,
                            m.flag("overwrite")};
       }},
      {"save_as",
       [](Members& m) -> Request {
         return SaveRequest{m.text("name", most_name_bytes), m.text("galaxy_text"), false,
                            m.flag("overwrite")};
       }},
      {"command",
       [](Members& m) -> Request {
         return CommandRequest{document_of(m), m.text_or("name", "", most_name_bytes)};
       }},
      {"render",
       [](Members& m) -> Request {
         return RenderRequest{document_of(m), m.text("name", most_name_bytes), m.flag("overwrite"),
                              m.flag("resume")};
       }},
  };
  return all;
}

}  // namespace

Message parse_message(std::string_view text) {
  std::optional<std::int64_t> id;
  try {
    if (text.size() > most_message_bytes) throw InputError("a message is too long");
    check_depth(text);
    const Json json = Json::parse(text);
    Members members(json, "a message");
    id = whole(members.get("id"), "id", std::numeric_limits<std::int64_t>::min(),
               std::numeric_limits<std::int64_t>::max());
    const std::string name = members.text("op", most_name_bytes);
    const auto found = message_parsers().find(name);
    if (found == message_parsers().end())
      throw input_error("there is no operation {}", in_quotes(name));
    Message message{*id, found->second(members)};
    members.finish();
    return message;
  } catch (const Json::exception&) {
    throw BadMessage(id, "a message is no JSON");
  } catch (const InputError& error) {
    throw BadMessage(id, error.what());
  }
}

std::string json_text(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace gamer
