#include "gamer/scene/word_table.h"

#include <gtest/gtest.h>

#include "scene/scene_checks.h"

namespace gamer {
namespace {

using test::message_of;

TEST(WordTable, SplitsAtBlanksAndSkipsComments) {
  const WordTable table = WordTable::parse(
      "# a comment\n\n  a\tb   c # the columns\n1 2 3\n   # nothing\n\t4 5\t\t6#7 # end", "t.lst");
  ASSERT_EQ(table.header().size(), 3u);
  EXPECT_EQ(table.header()[1].text, "b");
  EXPECT_EQ(table.where(table.header()[1]).text(), "t.lst:3:5");
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_EQ(table.row(1)[2].text, "6#7");
  EXPECT_EQ(table.where(table.row(1)[2]).text(), "t.lst:6:7");
}

TEST(WordTable, TakesCarriageReturnsAndAByteOrderMark) {
  const WordTable table = WordTable::parse(
      "\xef\xbb\xbf"
      "a b\r\n1 2\r\n",
      "t.lst");
  ASSERT_EQ(table.rows(), 1u);
  EXPECT_EQ(table.header()[0].text, "a");
  EXPECT_EQ(table.where(table.header()[0]).text(), "t.lst:1:1");
  EXPECT_EQ(table.row(0)[1].text, "2");
}

TEST(WordTable, CountsColumnsInCharacters) {
  const WordTable table = WordTable::parse("a b\n\xc3\xa9t\xc3\xa9 2\n", "t.lst");
  EXPECT_EQ(table.row(0)[1].column, 5);
}

TEST(WordTable, BadTables) {
  EXPECT_EQ(message_of([] { WordTable::parse("# only a comment\n", "t.lst"); }),
            "t.lst: there is no header row with the names of the columns");
  EXPECT_EQ(message_of([] { WordTable::parse("a b c\n1 2\n", "t.lst"); }),
            "t.lst:2:3: the row has 2 values for 3 columns");
  EXPECT_EQ(message_of([] { WordTable::parse("a b\n1 2 3 4\n", "t.lst"); }),
            "t.lst:2:5: the row has 4 values for 2 columns");
}

}  // namespace
}  // namespace gamer
