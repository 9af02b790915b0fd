#pragma once

#include <string>
#include <variant>
#include <vector>

namespace gamer {

/// A change of a scene list's text. Rows count from 0 as the text has them after the edits before.
struct SetCellEdit {
  int row = 0;
  std::string column;
  std::string word;  ///< "-" for no value
};
/// Adds a row behind a row, and like it, of another galaxy.
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
/// that the list lacks is added to all rows. What the text says afterwards is compared with what it
/// should say. Throws InputError where the text is no list with the names of its columns above its
/// rows. Throws it, too, where an edit has no meaning or takes the last row away.
std::string edit_scene(std::string text, const std::vector<SceneEdit>& edits,
                       const std::string& label);

}  // namespace gamer
