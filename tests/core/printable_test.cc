#include "gamer/core/printable.h"

#include <gtest/gtest.h>

namespace gamer::printable_test {
namespace {

TEST(Printable, TextStaysAsItIs) {
  for (const char* text : {"", "a.fits: no 'such' file\\n", "\u00e9\u4e2d\U0001F30C", "\u00a0",
                           "\u07ff\u0800", "\ud7ff\ue000\uffff", "\U00010000\U0010FFFF"}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, ControlCharactersAreEscaped) {
  EXPECT_EQ(printable("a\nb\rc\td"), "a\\nb\\rc\\td");
  EXPECT_EQ(printable("\x1b[2J\x7f"), "\\x1b[2J\\x7f");
  EXPECT_EQ(printable({"\0", 1}), "\\x00");
  // CSI is one character that begins a control sequence.
  EXPECT_EQ(printable("\xc2\x9b"), "\\xc2\\x9b");
}

TEST(Printable, BytesThatAreNotUtf8AreEscaped) {
  EXPECT_EQ(printable("\x9b"), "\\x9b");
  EXPECT_EQ(printable("\xc3"), "\\xc3");
  EXPECT_EQ(printable("\xe4\xb8x"), "\\xe4\\xb8x");
  EXPECT_EQ(printable("\xc0\x8a"), "\\xc0\\x8a");
  EXPECT_EQ(printable("\xff"), "\\xff");
  // Overlong forms: a line's end in three bytes and in four, CSI, the last character of two bytes.
  EXPECT_EQ(printable("\xe0\x80\x8a"), "\\xe0\\x80\\x8a");
  EXPECT_EQ(printable("\xf0\x80\x80\x8a"), "\\xf0\\x80\\x80\\x8a");
  EXPECT_EQ(printable("\xe0\x82\x9b"), "\\xe0\\x82\\x9b");
  EXPECT_EQ(printable("\xe0\x9f\xbf"), "\\xe0\\x9f\\xbf");
  // Surrogates, and numbers beyond Unicode.
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80");
  EXPECT_EQ(printable("\xed\xbf\xbf"), "\\xed\\xbf\\xbf");
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
  EXPECT_EQ(printable("\xf7\xbf\xbf\xbf"), "\\xf7\\xbf\\xbf\\xbf");
}

TEST(JsonString, KeepsUtf8AndEscapesOtherBytes) {
  EXPECT_EQ(json_string("a\"b\\ \u00e9\U0001F30C"), "\"a\\\"b\\\\ \u00e9\U0001F30C\"");
  EXPECT_EQ(json_string("\n\x7f\xb2"), "\"\\u000a\\u007f\\u00b2\"");
}

}  // namespace
}  // namespace gamer::printable_test
