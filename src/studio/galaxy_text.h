#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "gamer/core/parameter.h"

namespace gamer {

/// A list of tables of a galaxy's text: [[component]] or [[arm]].
enum class TextList { components, arms };

/// A change of a TOML text. Components and arms count from 0, in the text that the previous edits
/// leave.
struct SetEdit {
  std::optional<int> component;  ///< none: a key of the whole file
  std::string key;               ///< "rh", "noise.k0", "arms.count", "arm.0.offset"
  std::string value;             ///< in TOML syntax
};
struct ResetEdit {
  std::optional<int> component;
  std::string key;
};
struct AddEdit {
  std::string kind;
};
/// Adds an [[arm]] behind the last one, at a free angle if the other arms have angles. In a file
/// without [[arm]] the edit turns all arms of the pattern into tables, each with its angle, and
/// adds none.
struct AddArmEdit {};
struct CloneEdit {
  int index = 0;
  TextList list = TextList::components;
};
struct DeleteEdit {
  int index = 0;
  TextList list = TextList::components;
};
struct MoveEdit {
  int from = 0, to = 0;
  TextList list = TextList::components;
};
using TextEdit =
    std::variant<SetEdit, ResetEdit, AddEdit, AddArmEdit, CloneEdit, DeleteEdit, MoveEdit>;

/// Makes changes in the text of a galaxy or parameter file. Only the bytes of what changes are
/// replaced, so that comments, order and form stay. The new text is parsed, and its tree is
/// compared with the tree that the edits should give. `label` names the file in messages. Throws
/// InputError where the text is no TOML, an edit has no meaning, or a change of bytes cannot make
/// the edit.
std::string edit_text(std::string text, const std::vector<TextEdit>& edits,
                      const std::string& label);

}  // namespace gamer
