#include "galaxy/galaxy_overrides.h"

#include <algorithm>
#include <vector>

#include "core/message.h"
#include "gamer/core/near.h"

namespace gamer {
namespace {

/// The text of a member; empty if the member is no text.
std::string member_text(const ConfigNode& node, std::string_view key) {
  const ConfigNode* member = node.find(key);
  const auto* text = member == nullptr ? nullptr : std::get_if<std::string>(&member->data);
  return text == nullptr ? "" : *text;
}

/// Replaces members of `to` by those of `from`; nested tables are merged too.
void merge(const ConfigNode& from, ConfigNode& to) {
  if (!from.is_table() || !to.is_table()) {
    to = from;
    return;
  }
  for (const auto& [key, member] : from.table()) {
    if (ConfigNode* const known = to.find(key)) {
      merge(member, *known);
    } else {
      to.table().emplace_back(key, member);
    }
  }
}

/// The components of a file with their names.
class NamedComponents {
 public:
  explicit NamedComponents(ConfigNode& file) {
    ConfigNode* const list = file.find("component");
    if (list == nullptr || !list->is_array()) return;
    for (ConfigNode& node : list->array()) {
      const std::string kind = member_text(node, "class"), name = member_text(node, "name");
      nodes_.push_back(&node);
      kinds_.push_back(kind);
      places_.push_back(fmt::format("{}{}", kind, nodes_.size()));
      names_.push_back(name.empty() ? places_.back() : bare_name(name));
    }
  }

  ConfigNode& find(const std::string& name, const SourceLocation& where) const {
    for (const auto* called : {&names_, &places_, &kinds_}) {
      if (std::ranges::count(*called, name) != 1) continue;
      return *nodes_[static_cast<std::size_t>(std::ranges::find(*called, name) - called->begin())];
    }
    std::vector<std::string> known = {"galaxy", "arms"};
    known.insert(known.end(), names_.begin(), names_.end());
    throw input_error(where, "the galaxy has no component {}{}; it has '{}'", in_quotes(name),
                      did_you_mean(name, known), fmt::join(known, "', '"));
  }

 private:
  std::vector<ConfigNode*> nodes_;
  std::vector<std::string> names_, places_, kinds_;
};

void require_table(const ConfigNode& node) {
  if (node.is_table()) return;
  throw InputError(node.key_where,
                   "a key of a galaxy is galaxy.TYPE.COMPONENT.key, such as "
                   "galaxy.m51.dust.optical_depth");
}

}  // namespace

std::string bare_name(std::string name) {
  for (char& c : name) {
    if (!is_bare_key({&c, 1})) c = '_';
  }
  return name;
}

void apply_overrides(const ConfigNode& overrides, ConfigNode& file) {
  require_table(overrides);
  for (const auto& [name, values] : overrides.table()) {
    require_table(values);
    if (name == "galaxy" || name == "arms") {
      ConfigNode change;
      change.table().emplace_back(name, values);
      merge(change, file);
    } else {
      merge(values, NamedComponents(file).find(name, values.key_where));
    }
  }
}

}  // namespace gamer
