#include "studio/scene_text.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "gamer/core/error.h"

namespace gamer::scene_text_test {
namespace {

const std::string list =
    "# The field.\n"
    "galaxy   x    y  seed  # columns\n"
    "\n"
    "spiral   0    0  1     # the first\n"
    "# behind it\n"
    "m51      0.5  2  -\n";

std::string edited_scene(const std::string& text, const std::vector<SceneEdit>& edits) {
  return edit_scene(text, edits, "x.lst");
}

std::string message(const std::string& text, const std::vector<SceneEdit>& edits) {
  try {
    edited_scene(text, edits);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  text.replace(text.find(from), from.size(), to);
  return text;
}

TEST(SceneText, CellsAreReplacedInTheirColumns) {
  EXPECT_EQ(edited_scene(list, {}), list);
  EXPECT_EQ(edited_scene(list, {SetCellEdit{0, "x", "12"}}),
            replaced(list, "spiral   0    0", "spiral   12   0"));
  EXPECT_EQ(edited_scene(list, {SetCellEdit{0, "x", "0.123456"}}),
            replaced(list, "spiral   0    0", "spiral   0.123456 0"));
  EXPECT_EQ(edited_scene(list, {SetCellEdit{1, "seed", "7"}}), replaced(list, "2  -", "2  7"));
  EXPECT_EQ(edited_scene(list, {SetCellEdit{0, "galaxy", "ngc4321"}}),
            replaced(list, "spiral   0", "ngc4321  0"));
  EXPECT_EQ(edited_scene("galaxy\tx\ty\r\na\t1\t2\r\n", {SetCellEdit{0, "x", "10"}}),
            "galaxy\tx\ty\r\na\t10\t2\r\n");
  EXPECT_EQ(edited_scene("galaxy x\na 1", {SetCellEdit{0, "x", "22"}}), "galaxy x\na 22");
}

TEST(SceneText, ColumnsAreAddedToAllRows) {
  EXPECT_EQ(edited_scene(list, {SetCellEdit{1, "pa", "30"}}),
            "# The field.\n"
            "galaxy   x    y  seed pa  # columns\n"
            "\n"
            "spiral   0    0  1 -     # the first\n"
            "# behind it\n"
            "m51      0.5  2  - 30\n");
  EXPECT_EQ(edited_scene(list, {SetCellEdit{1, "pa", "-"}}), list);
  EXPECT_EQ(message(list, {SetCellEdit{1, "pq", "3"}}), "x.lst: a scene has no column 'pq'");
  EXPECT_NE(edited_scene(list, {SetCellEdit{1, "arms.count", "3"}}), list);
}

TEST(SceneText, RowsAreClonedAddedAndDeleted) {
  const std::string first = "spiral   0    0  1     # the first\n";
  EXPECT_EQ(edited_scene(list, {CloneRowEdit{0}}), replaced(list, first, first + first));
  EXPECT_EQ(edited_scene(list, {CloneRowEdit{0}, DeleteRowEdit{1}}), list);
  EXPECT_EQ(edited_scene(list, {DeleteRowEdit{0}}), replaced(list, first, ""));
  EXPECT_EQ(edited_scene(list, {AddRowEdit{0, "lmc"}}),
            replaced(list, first, first + "lmc      0    0  1     # the first\n"));
  EXPECT_EQ(edited_scene("galaxy x sed arms.count\na 1 E 3\n", {AddRowEdit{0, "b"}}),
            "galaxy x sed arms.count\na 1 E 3\nb 1 - -\n");
  EXPECT_EQ(edited_scene("galaxy x\na 1", {CloneRowEdit{0}}), "galaxy x\na 1\na 1");
  EXPECT_EQ(message("galaxy x\na 1\n", {DeleteRowEdit{0}}),
            "x.lst: a scene needs at least one row");
}

TEST(SceneText, WhatHasNoMeaningIsAnError) {
  for (const char* word : {"", "a b", "#a", "a\nb", "\"a"}) {
    EXPECT_NE(message(list, {SetCellEdit{0, "x", word}}), "") << word;
  }
  for (const SceneEdit& edit : std::vector<SceneEdit>{SetCellEdit{2, "x", "1"}, CloneRowEdit{-1},
                                                      DeleteRowEdit{2}, AddRowEdit{9, "a"}}) {
    EXPECT_NE(message(list, {edit}), "") << edit.index();
  }
  for (const char* text :
       {"", "galaxy x\n", "galaxy,x\na,1\n", "x y\n1 2\n", "galaxy x\na\n", "# galaxy x\na 1\n"}) {
    EXPECT_NE(message(text, {CloneRowEdit{0}}), "") << text;
  }
}

TEST(SceneText, ThousandsOfRowsAreEdited) {
  std::string text = "galaxy x y\n", after = text;
  for (int row = 0; row < 2000; ++row) {
    text += "spiral " + std::to_string(row) + " 0\n";
    after += "spiral " + std::to_string(row == 1234 ? -5 : row) + (row == 1234 ? "   0\n" : " 0\n");
  }
  EXPECT_EQ(edited_scene(text, {SetCellEdit{1234, "x", "-5"}}), after);
}

}  // namespace
}  // namespace gamer::scene_text_test
