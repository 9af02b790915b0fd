#include "gamer/core/shell_word.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <string>

namespace gamer::shell_word_test {
namespace {

TEST(ShellWord, PlainWordsStayAsTheyAre) {
  EXPECT_EQ(shell_word("a/b-c.par"), "a/b-c.par");
  EXPECT_EQ(shell_word("it's"), "'it'\\''s'");
  EXPECT_EQ(shell_word(""), "''");
}

// Bash reads the quoted word as the original word.
TEST(ShellWord, AShellReadsTheWord) {
  for (const std::string word :
       {"a b", "$HOME `x` \"q\"", "it's", "\x1b[31m\nb'\\ \xc3\xa9", "\xff"}) {
    std::FILE* pipe =
        popen(("exec bash <<'SCRIPT'\nprintf %s " + shell_word(word) + "\nSCRIPT\n").c_str(), "r");
    ASSERT_NE(pipe, nullptr);
    std::array<char, 256> read{};
    const std::size_t size = std::fread(read.data(), 1, read.size(), pipe);
    EXPECT_EQ(pclose(pipe), 0);
    EXPECT_EQ(std::string(read.data(), size), word);
  }
}

}  // namespace
}  // namespace gamer::shell_word_test
