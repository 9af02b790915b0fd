#pragma once

#include <string>
#include <variant>
#include <vector>

namespace gamer {

/// A change of a scene list's text. Rows count from 0, in the text that the previous edits leave.
struct SetCellEdit {
  int row = 0;
  std::string column;
  std::string word;  ///< "-" for no value
};
/// Adds a row of another galaxy behind a row. Its values are those of that row, without id, sed and
/// overrides.
struct AddRowEdit {
  int row = 0;
  std::string galaxy;
};
struct CloneRowEdit {
  int row = 0;
};
struct DeleteRowEdit {
  int row = 0;
};
using SceneEdit = std::variant<SetCellEdit, AddRowEdit, CloneRowEdit, DeleteRowEdit>;

/// Makes changes in the text of a scene list. Comments and other rows keep their bytes; a column
/// that the list lacks is added to all rows. The new text is read, and its words are compared with
/// those that the edits should give. Throws InputError where the text is no list with the names of
/// its columns above its rows. Other errors are an edit that has no meaning, and one that takes the
/// last row away.
std::string edit_scene(std::string text, const std::vector<SceneEdit>& edits,
                       const std::string& label);

}  // namespace gamer
