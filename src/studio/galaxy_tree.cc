#include "studio/galaxy_tree.h"

#include <algorithm>
#include <charconv>

#include "core/message.h"

namespace gamer {
namespace {

bool is_nothing(const ConfigNode& node) {
  return node.is_table() &&
         std::ranges::all_of(node.table(), [](const auto& one) { return is_nothing(one.second); });
}

}  // namespace

ConfigNode::Array& components_of(ConfigNode& root) {
  ConfigNode* list = root.find("component");
  if (list == nullptr || !list->is_array()) {
    throw InputError(root.where, "a galaxy needs at least one [[component]]");
  }
  return list->array();
}

ConfigNode& component_at(ConfigNode& root, int component) {
  ConfigNode::Array& list = components_of(root);
  if (component < 0 || component >= static_cast<int>(list.size())) {
    throw input_error(root.where, "there is no component {}; the galaxy has {}", component,
                      list.size());
  }
  ConfigNode& node = list[static_cast<std::size_t>(component)];
  if (!node.is_table()) throw InputError(node.where, "[[component]] must be a table");
  return node;
}

ConfigNode& table_of(ConfigNode& root, std::optional<int> component,
                     std::vector<std::string>& key) {
  if (component) return component_at(root, *component);
  ConfigNode* list = root.find(key.front());
  if (list == nullptr || !list->is_array() || key.size() < 3) return root;
  std::size_t index = 0;
  const std::string& number = key[1];
  const auto end = number.data() + number.size();
  auto& elements = list->array();
  if (std::from_chars(number.data(), end, index).ptr != end || index >= elements.size() ||
      !elements[index].is_table()) {
    throw input_error(list->where, "there is no [[{}]] {}", key.front(), number);
  }
  key.erase(key.begin(), key.begin() + 2);
  return elements[index];
}

void set_node(ConfigNode& table, const std::vector<std::string>& key, const ConfigNode* value) {
  ConfigNode* node = &table;
  for (std::size_t part = 0; part + 1 < key.size(); ++part) {
    ConfigNode* member = node->find(key[part]);
    if (member == nullptr || !member->is_table()) {
      if (value == nullptr) return;
      if (member == nullptr) member = &node->table().emplace_back(key[part], ConfigNode{}).second;
      member->data = ConfigNode::Table{};
    }
    node = member;
  }
  ConfigNode* member = node->find(key.back());
  if (value == nullptr) {
    std::erase_if(node->table(), [&](const auto& one) { return one.first == key.back(); });
  } else if (member != nullptr) {
    *member = *value;
  } else {
    node->table().emplace_back(key.back(), *value);
  }
}

bool are_equal(const ConfigNode& a, const ConfigNode& b) {
  if (a.is_table() && b.is_table()) {
    const auto has_all = [](const ConfigNode& some, const ConfigNode& others) {
      return std::ranges::all_of(some.table(), [&](const auto& one) {
        const ConfigNode* other = others.find(one.first);
        return other != nullptr ? are_equal(one.second, *other) : is_nothing(one.second);
      });
    };
    return has_all(a, b) && std::ranges::all_of(b.table(), [&](const auto& one) {
             return a.find(one.first) != nullptr || is_nothing(one.second);
           });
  }
  if (a.is_array() && b.is_array()) return std::ranges::equal(a.array(), b.array(), are_equal);
  if (a.data.index() != b.data.index()) return false;
  if (const auto* number = std::get_if<double>(&a.data)) return *number == std::get<double>(b.data);
  if (const auto* whole = std::get_if<std::int64_t>(&a.data)) {
    return *whole == std::get<std::int64_t>(b.data);
  }
  if (const auto* flag = std::get_if<bool>(&a.data)) return *flag == std::get<bool>(b.data);
  const auto* text = std::get_if<std::string>(&a.data);
  return text != nullptr && *text == std::get<std::string>(b.data);
}

}  // namespace gamer
