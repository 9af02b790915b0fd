#include "studio/galaxy_text.h"

#include <algorithm>
#include <functional>
#include <ranges>
#include <utility>

#include "core/message.h"
#include "gamer/core/config.h"
#include "gamer/galaxy/component.h"
#include "studio/arm_tables.h"
#include "studio/galaxy_tree.h"
#include "studio/model.h"
#include "studio/toml_layout.h"

namespace gamer {
namespace {

using Key = std::vector<std::string>;

constexpr std::size_t most_galaxy_bytes = std::size_t{4} << 20;

/// A key in TOML syntax.
std::string key_text(const Key& key) {
  const auto quoted = [](const std::string& part) {
    return is_bare_key(part) ? part : toml_string(part);
  };
  return fmt::format("{}", fmt::join(key | std::views::transform(quoted), "."));
}

bool begins(const Key& key, const Key& with) {
  return with.size() <= key.size() && std::equal(with.begin(), with.end(), key.begin());
}

Key joined(Key a, const Key& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Key without(const Key& key, std::size_t parts) {
  return {key.begin() + static_cast<std::ptrdiff_t>(parts), key.end()};
}

/// "{ noise = { k0 = 3 } }" for a value inside tables; the value alone where there is no key.
std::string nested(const Key& key, const std::string& value) {
  std::string text = value;
  for (auto part = key.rbegin(); part != key.rend(); ++part) {
    text = fmt::format("{{ {} = {} }}", key_text({*part}), text);
  }
  return text;
}

/// The bytes of a text where an edit takes place: the sections of one table.
class TextTable {
 public:
  /// A section of the table, and the section's key relative to the table.
  struct Part {
    Key key;
    const TomlSection* section;
  };

  TextTable(std::string& text, std::vector<Part> parts, std::string line_end, bool is_root)
      : text_(&text), parts_(std::move(parts)), line_end_(std::move(line_end)), is_root_(is_root) {}

  /// Whether a pair has this very key, or a beginning of it.
  bool has(const Key& key) const {
    return std::ranges::any_of(parts_, [&](const Part& part) {
      return std::ranges::any_of(part.section->pairs, [&](const TomlPair& pair) {
        return begins(key, joined(part.key, pair.key));
      });
    });
  }

  /// Returns false where the table has no place for the key: a section is to be added.
  bool set(const Key& key, const std::string& value) {
    for (const Part& part : parts_) {
      for (const TomlPair& pair : part.section->pairs) {
        if (set_in(pair, joined(part.key, pair.key), key, value)) return true;
      }
    }
    return add(key, value);
  }

  /// Removes the pair of a key and all pairs below it, if there are any.
  void reset(const Key& key) {
    std::vector<std::pair<std::size_t, std::size_t>> gone;
    for (const Part& part : parts_) {
      if (part.key.size() >= key.size() && begins(part.key, key)) {
        gone.emplace_back(part.section->lead, part.section->end);
        continue;
      }
      for (const TomlPair& pair : part.section->pairs) {
        const Key whole_key = joined(part.key, pair.key);
        if (begins(whole_key, key)) {
          gone.emplace_back(pair.line_begin, pair.line_end);
        } else if (begins(key, whole_key) && (*text_)[pair.value_begin] == '{') {
          add_member_range(pair.value_begin, without(key, whole_key.size()), gone);
        }
      }
    }
    std::ranges::sort(gone, std::greater<>());
    for (const auto& [begin, end] : gone) text_->erase(begin, end - begin);
  }

 private:
  /// Sets a key at a pair or in its inline table.
  bool set_in(const TomlPair& pair, const Key& pair_key, const Key& key, const std::string& value) {
    if (begins(pair_key, key)) {
      if (pair_key.size() > key.size()) return false;
      replace(pair, value);
      return true;
    }
    if (!begins(key, pair_key)) return false;
    const Key rest = without(key, pair_key.size());
    if ((*text_)[pair.value_begin] != '{') {
      replace(pair, nested(rest, value));
      return true;
    }
    const std::vector<TomlPair> members = inline_members(*text_, pair.value_begin);
    for (const TomlPair& member : members) {
      if (set_in(member, member.key, rest, value)) return true;
    }
    const std::string entry =
        fmt::format("{} = {}", key_text({rest.front()}), nested(without(rest, 1), value));
    if (members.empty()) {
      text_->replace(pair.value_begin, pair.value_end - pair.value_begin,
                     fmt::format("{{ {} }}", entry));
    } else {
      text_->insert(members.back().value_end, ", " + entry);
    }
    return true;
  }

  void replace(const TomlPair& pair, const std::string& value) {
    text_->replace(pair.value_begin, pair.value_end - pair.value_begin, value);
  }

  /// The part whose key is the longest beginning of `key`.
  const Part* nearest(const Key& key) const {
    const Part* found = nullptr;
    for (const Part& part : parts_) {
      if (part.key.size() >= key.size() || !begins(key, part.key)) continue;
      if (found == nullptr || part.key.size() > found->key.size()) found = &part;
    }
    return found;
  }

  bool add(const Key& key, const std::string& value) {
    const Part* part = nearest(key);
    if (part == nullptr) return false;
    const Key rest = without(key, part->key.size());
    const TomlSection& section = *part->section;
    // Behind pairs with dotted keys of the same table, else behind the last pair.
    const TomlPair* last = section.pairs.empty() ? nullptr : &section.pairs.back();
    bool is_dotted = false;
    for (const TomlPair& pair : section.pairs) {
      if (rest.size() > 1 && pair.key.size() > 1 && pair.key.front() == rest.front()) {
        is_dotted = true;
        last = &pair;
      }
    }
    if (is_root_ && part->key.empty() && rest.size() > 1 && !is_dotted) return false;
    const std::string entry = is_dotted ? fmt::format("{} = {}", key_text(rest), value)
                                        : fmt::format("{} = {}", key_text({rest.front()}),
                                                      nested(without(rest, 1), value));
    std::size_t at = last != nullptr ? last->line_end : section.body;
    std::string line = entry + line_end_;
    if (last != nullptr) line.insert(0, indentation(*last));
    if (at > 0 && (*text_)[at - 1] != '\n') line.insert(0, line_end_);
    text_->insert(at, line);
    return true;
  }

  std::string indentation(const TomlPair& pair) const {
    return text_->substr(pair.line_begin, pair.key_begin - pair.line_begin);
  }

  /// The bytes of a member of an inline table, with one comma.
  void add_member_range(std::size_t begin, const Key& key,
                        std::vector<std::pair<std::size_t, std::size_t>>& gone) const {
    const std::vector<TomlPair> members = inline_members(*text_, begin);
    for (std::size_t m = 0; m < members.size(); ++m) {
      const TomlPair& member = members[m];
      if (begins(member.key, key)) {
        if (m > 0) {
          gone.emplace_back(members[m - 1].value_end, member.value_end);
        } else if (members.size() > 1) {
          gone.emplace_back(member.key_begin, members[1].key_begin);
        } else {
          gone.emplace_back(begin + 1, (*text_).find('}', member.value_end));
        }
        return;
      }
      if (begins(key, member.key) && (*text_)[member.value_begin] == '{') {
        return add_member_range(member.value_begin, without(key, member.key.size()), gone);
      }
    }
  }

  std::string* text_;
  std::vector<Part> parts_;
  std::string line_end_;
  bool is_root_;  ///< new tables are sections of their own
};

/// The text of a component: its header with comments above, pairs and tables below it.
struct Slot {
  std::size_t begin = 0, end = 0;
};

/// A text and its tree, which edits change together.
class EditedText {
 public:
  EditedText(std::string text, const std::string& label)
      : text_(std::move(text)),
        label_(label),
        tree_(parse_toml(text_, label)),
        line_end_(text_.find("\r\n") != std::string::npos ? "\r\n" : "\n") {}

  void operator()(const SetEdit& edit) {
    const ConfigNode document = parse_toml("value = " + edit.value, label_);
    const ConfigNode& value = *document.find("value");
    const bool* flag = std::get_if<bool>(&value.data);
    // noise = true removes noise = false; a table `noise` stays.
    if (edit.component && edit.key == "noise" && flag != nullptr && *flag) return switch_on(edit);
    Key key = parts_of(edit.key);
    set_node(table_of(tree_, edit.component, key), key, &value);
    // A value replaces the tables below its key.
    key = parts_of(edit.key);
    TextTable place = table(edit.component, key);
    if (!place.has(key)) {
      place.reset(key);
      place = table(edit.component, key = parts_of(edit.key));
    }
    if (!place.set(key, edit.value)) add_section(key, edit.value);
  }

  void operator()(const ResetEdit& edit) {
    Key key = parts_of(edit.key);
    set_node(table_of(tree_, edit.component, key), key, nullptr);
    key = parts_of(edit.key);
    table(edit.component, key).reset(key);
  }

  void operator()(const AddEdit& edit) {
    const std::string block = new_component(edit.kind);
    add_to_tree(components_of(tree_), block, "component");
    insert_behind(slots(TextList::components).back(), block);
  }

  void operator()(const AddArmEdit&) {
    if (tree_.find("arm") == nullptr) return add_first_arms();
    const std::string block = arm_block(free_angle(tree_));
    add_to_tree(arms_of(tree_), block, "arm");
    insert_behind(slots(TextList::arms).back(), block);
  }

  void operator()(const CloneEdit& edit) {
    element_at(edit.list, edit.index);
    const auto index = static_cast<std::size_t>(edit.index);
    const bool is_component = edit.list == TextList::components;
    std::string name;
    if (is_component) {
      name = free_name(component_names(tree_)[index]);
      keep_names(index + 1);
    } else {
      renumber([&](int arm) { return arm > edit.index ? arm + 1 : arm; });
    }
    ConfigNode copy = element_at(edit.list, edit.index);
    ConfigNode value;
    value.data = name;
    if (is_component) set_node(copy, {"name"}, &value);
    auto& list = list_of(edit.list);
    list.insert(list.begin() + edit.index + 1, copy);
    const Slot slot = slots(edit.list)[index];
    insert_behind(slot, text_.substr(slot.begin, slot.end - slot.begin));
    if (is_component) table(edit.index + 1, {"name"}).set({"name"}, toml_string(name));
  }

  void operator()(const DeleteEdit& edit) {
    element_at(edit.list, edit.index);
    const auto index = static_cast<std::size_t>(edit.index);
    if (edit.list == TextList::components) {
      if (list_of(edit.list).size() == 1) {
        throw InputError({label_, 0, 0}, "a galaxy needs at least one [[component]]");
      }
      keep_names(index + 1);
    } else {
      refuse_left_arm(tree_, edit.index);
      renumber([&](int arm) { return arm > edit.index ? arm - 1 : arm; });
    }
    auto& list = list_of(edit.list);
    list.erase(list.begin() + edit.index);
    const std::vector<Slot> all = slots(edit.list);
    if (list.empty())
      std::erase_if(tree_.table(), [](const auto& one) { return one.first == "arm"; });
    std::size_t begin = all[index].begin, end = all[index].end;
    // Blank lines behind the table are erased too, or those before it at the text's end.
    while (end < text_.size() && (text_[end] == '\n' || text_[end] == '\r')) ++end;
    if (end == text_.size()) {
      while (begin > 1 && text_[begin - 1] == '\n' &&
             (text_[begin - 2] == '\n' || text_[begin - 2] == '\r')) {
        begin -= text_[begin - 2] == '\r' ? 2 : 1;
      }
    }
    text_.erase(begin, end - begin);
  }

  void operator()(const MoveEdit& edit) {
    element_at(edit.list, edit.from);
    element_at(edit.list, edit.to);
    const auto [first, last] = std::minmax(edit.from, edit.to);
    if (edit.list == TextList::components) {
      keep_names(static_cast<std::size_t>(first), static_cast<std::size_t>(last) + 1);
    } else {
      renumber([&](int arm) { return place_after(edit, arm); });
    }
    const auto rotate = [&](auto& list) {
      const auto begin = list.begin();
      if (edit.from < edit.to) {
        std::rotate(begin + edit.from, begin + edit.from + 1, begin + edit.to + 1);
      } else {
        std::rotate(begin + edit.to, begin + edit.from, begin + edit.from + 1);
      }
    };
    rotate(list_of(edit.list));
    const std::vector<Slot> all = slots(edit.list);
    std::vector<std::string> blocks;
    for (const Slot& slot : all) {
      blocks.push_back(with_line_end(text_.substr(slot.begin, slot.end - slot.begin)));
    }
    rotate(blocks);
    for (std::size_t i = all.size(); i-- > 0;) {
      text_.replace(all[i].begin, all[i].end - all[i].begin, blocks[i]);
    }
  }

  /// Throws InputError where the tree of the text differs from tree_.
  void check() const {
    bool is_right = false;
    try {
      is_right = are_equal(parse_toml(text_, label_), tree_);
    } catch (const InputError&) {
    }
    if (!is_right) {
      throw InputError({label_, 0, 0},
                       "the file is written in a way that cannot be changed here; change it in an "
                       "editor");
    }
  }

  std::string take() { return std::move(text_); }

 private:
  Key parts_of(const std::string& key) const {
    const Key parts = key_parts(key);
    if (!std::ranges::all_of(parts, is_bare_key)) {
      throw InputError({label_, 0, 0}, "a key is of letters, digits, _ and -");
    }
    constexpr std::size_t most_parts = 8;
    if (parts.size() > most_parts) throw InputError({label_, 0, 0}, "a key has too many parts");
    return parts;
  }

  std::string with_line_end(std::string block) const {
    if (!block.ends_with('\n')) block += line_end_;
    return block;
  }

  void switch_on(const SetEdit& edit) {
    const ConfigNode* noise = component_at(tree_, *edit.component).find("noise");
    if (noise != nullptr && !noise->is_table()) (*this)(ResetEdit{edit.component, "noise"});
  }

  /// The sections of a component or of the root; a list's number is taken off the key.
  TextTable table(std::optional<int> component, Key& key) {
    sections_ = toml_sections(text_);
    const ConfigNode::Array* list = nullptr;
    const ConfigNode* node = component ? nullptr : tree_.find(key.front());
    if (node != nullptr && node->is_array() && key.size() >= 3) list = &node->array();
    if (!component && list == nullptr) {
      std::vector<TextTable::Part> parts;
      bool is_below_list = false;
      for (const TomlSection& section : sections_) {
        if (section.is_list) is_below_list = true;
        const bool is_of_list =
            is_below_list && !section.path.empty() &&
            (section.path.front() == "component" || section.path.front() == "arm");
        if (!section.is_list && !is_of_list) parts.push_back({section.path, &section});
      }
      return {text_, parts, line_end_, true};
    }
    const std::string name = component ? "component" : key.front();
    const auto number = component ? *component : std::stoi(key[1]);
    if (!component) key.erase(key.begin(), key.begin() + 2);
    return {text_, parts_of_element(name, number), line_end_, false};
  }
  TextTable table(std::optional<int> component, Key&& key) { return table(component, key); }

  std::vector<TextTable::Part> parts_of_element(const std::string& name, int number) const {
    std::vector<TextTable::Part> parts;
    int count = -1;
    for (const TomlSection& section : sections_) {
      if (section.path.empty() || section.path.front() != name) continue;
      if (section.is_list && section.path.size() == 1) ++count;
      if (count == number) parts.push_back({without(section.path, 1), &section});
    }
    return parts;
  }

  static const char* name_of(TextList list) {
    return list == TextList::components ? "component" : "arm";
  }
  ConfigNode::Array& list_of(TextList list) {
    return list == TextList::components ? components_of(tree_) : arms_of(tree_);
  }
  /// An element of a list. Throws InputError where the list has no element of this number.
  ConfigNode& element_at(TextList list, int index) {
    return list == TextList::components ? component_at(tree_, index) : arm_at(tree_, index);
  }

  /// The place of an element after a move.
  static int place_after(const MoveEdit& edit, int place) {
    if (place == edit.from) return edit.to;
    if (edit.from < place && place <= edit.to) return place - 1;
    return edit.to <= place && place < edit.from ? place + 1 : place;
  }

  /// Gives branches the new numbers of the arms that they leave.
  void renumber(const std::function<int(int arm)>& number) {
    const ConfigNode::Array arms = arms_of(tree_);
    for (std::size_t i = 0; i < arms.size(); ++i) {
      const std::optional<int> left = arm_left_by(arms[i]);
      if (!left || number(*left) == *left) continue;
      (*this)(SetEdit{{}, fmt::format("arm.{}.leaves", i), fmt::format("{}", number(*left) + 1)});
    }
  }

  std::string arm_block(const std::optional<double>& offset) const {
    const std::string head = "[[arm]]" + line_end_;
    return offset ? fmt::format("{}offset = {}{}", head, value_text(*offset), line_end_) : head;
  }

  void add_to_tree(ConfigNode::Array& list, const std::string& block, const char* name) const {
    const ConfigNode parsed = parse_toml(block, label_);
    for (const ConfigNode& one : parsed.find(name)->array()) list.push_back(one);
  }

  /// Writes the arms of the pattern as tables, which replace `count` and `offsets`.
  void add_first_arms() {
    std::string blocks;
    for (const double angle : pattern_angles(tree_)) {
      blocks += (blocks.empty() ? "" : line_end_) + arm_block(angle);
    }
    for (const char* key : {"arms.count", "arms.offsets"}) (*this)(ResetEdit{{}, key});
    ConfigNode::Array arms;
    add_to_tree(arms, blocks, "arm");
    tree_.table().emplace_back("arm", ConfigNode{}).second.data = arms;
    sections_ = toml_sections(text_);
    const auto list = std::ranges::find_if(sections_, &TomlSection::is_list);
    text_.insert(list != sections_.end() ? list->lead : text_.size(), blocks + line_end_);
  }

  /// The places of a list's tables. Throws InputError where they are not written as [[component]].
  std::vector<Slot> slots(TextList list) {
    sections_ = toml_sections(text_);
    std::vector<Slot> result;
    bool is_open = false;
    for (const TomlSection& section : sections_) {
      const bool is_of_list = !section.path.empty() && section.path.front() == name_of(list);
      if (is_of_list && section.is_list && section.path.size() == 1) {
        result.push_back({section.lead, section.content_end});
        is_open = true;
      } else if (is_of_list && is_open) {
        result.back().end = section.content_end;
      } else {
        is_open = false;
      }
    }
    if (result.empty()) {
      throw input_error(SourceLocation{label_, 0, 0}, "write each {0} as [[{0}]]", name_of(list));
    }
    return result;
  }

  void insert_behind(const Slot& slot, std::string block) {
    block = with_line_end(std::move(block));
    const bool ends_line = slot.end > 0 && text_[slot.end - 1] == '\n';
    text_.insert(slot.end, (ends_line ? "" : line_end_) + line_end_ + block);
  }

  /// Writes the default names of components without a name whose number would change.
  void keep_names(std::size_t first, std::size_t last = std::string::npos) {
    const std::vector<std::string> names = component_names(tree_);
    for (std::size_t c = first; c < std::min(last, names.size()); ++c) {
      const int index = static_cast<int>(c);
      if (component_at(tree_, index).find("name") != nullptr) continue;
      (*this)(SetEdit{index, "name", toml_string(names[c])});
    }
  }

  std::string free_name(const std::string& name) {
    const std::vector<std::string> names = component_names(tree_);
    // "arms 2" is followed by "arms 3".
    std::string stem = name;
    const std::size_t blank = stem.rfind(' ');
    if (blank != std::string::npos && blank + 1 < stem.size() &&
        stem.find_first_not_of("0123456789", blank + 1) == std::string::npos) {
      stem.resize(blank);
    }
    for (int number = 2;; ++number) {
      std::string free = fmt::format("{} {}", stem, number);
      if (std::ranges::count(names, free) == 0) return free;
    }
  }

  std::string new_component(const std::string& kind_name) {
    const ComponentKind& kind = find_component_kind(kind_name, {label_, 0, 0});
    const std::vector<std::string> names = component_names(tree_);
    std::string name = kind.name;
    if (std::ranges::count(names, name) > 0) name = free_name(name);
    std::string block = fmt::format("[[component]]{0}class = {1}{0}name = {2}{0}", line_end_,
                                    toml_string(kind.name), toml_string(name));
    for (const Parameter& parameter : kind.parameters) {
      // A bulge needs one of two radii, neither of which is required by itself.
      const bool is_needed = parameter.required || parameter.name == "effective_radius";
      if (!is_needed || parameter.name == "class") continue;
      block += fmt::format("{} = {}{}", parameter.name, first_value(kind, parameter), line_end_);
    }
    if (kind.traits.emits) block += fmt::format("fraction = 0.1{}", line_end_);
    return block;
  }

  /// A sensible value of a required parameter.
  static std::string first_value(const ComponentKind& kind, const Parameter& parameter) {
    if (parameter.name == "sed") {
      if (kind.name == "bulge" || kind.name == "sersic" || kind.name == "bar") return "\"E\"";
      return kind.name == "disk" || kind.name == "starfield" ? "\"Sbc\"" : "\"Im\"";
    }
    if (parameter.type == ParameterType::number) {
      constexpr double usual = 0.1;
      const Interval& interval = parameter.interval;
      if (interval.contains(usual)) return value_text(usual);
      const double low = std::max(interval.low, -1e6), high = std::min(interval.high, 1e6);
      return value_text((low + high) / 2);
    }
    if (parameter.type == ParameterType::integer) {
      return fmt::format("{}", static_cast<long long>(std::max(parameter.interval.low, 1.0)));
    }
    if (!parameter.choices.empty()) return toml_string(parameter.choices.front());
    return "\"\"";
  }

  /// Adds a section for a key of the root: before lists of a galaxy, else at the end.
  void add_section(const Key& key, const std::string& value) {
    sections_ = toml_sections(text_);
    if (key.size() < 2) {
      text_.insert(0, fmt::format("{} = {}{}", key_text(key), value, line_end_));
      return;
    }
    const std::string section =
        fmt::format("[{}]{}{} = {}{}", key_text({key.front()}), line_end_, key_text({key[1]}),
                    nested(without(key, 2), value), line_end_);
    for (const TomlSection& other : sections_) {
      if (!other.is_list) continue;
      text_.insert(other.lead, section + line_end_);
      return;
    }
    const bool ends_line = text_.empty() || text_.back() == '\n';
    text_ += (ends_line ? "" : line_end_) + (text_.empty() ? "" : line_end_) + section;
  }

  std::string text_;
  std::string label_;
  ConfigNode tree_;  ///< tree that the text must have
  std::string line_end_;
  std::vector<TomlSection> sections_;
};

}  // namespace

std::string edit_text(std::string text, const std::vector<TextEdit>& edits,
                      const std::string& label) {
  EditedText edited(std::move(text), label);
  for (const TextEdit& edit : edits) {
    std::visit(edited, edit);
    edited.check();
  }
  text = edited.take();
  if (text.size() > most_galaxy_bytes) throw InputError({label, 0, 0}, "the text becomes too long");
  return text;
}

}  // namespace gamer
