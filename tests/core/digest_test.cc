#include "gamer/core/digest.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace gamer::digest_test {
namespace {

// Texts that differ in one character, in length or in order have different digests.
TEST(Digest, TellsTextsApart) {
  std::set<std::string> digests;
  std::size_t texts = 0;
  const auto add = [&](const std::string& text) {
    EXPECT_EQ(digest(text).size(), 32u);
    digests.insert(digest(text));
    ++texts;
  };
  for (std::size_t length = 0; length <= 40; ++length) {
    add(std::string(length, '\0'));
    for (std::size_t i = 0; i < length; ++i) {
      for (const char c : {'a', 'b', '\xff'}) {
        std::string text(length, '\0');
        text[i] = c;
        add(text);
      }
    }
  }
  add("abcdefgh12345678");
  add("12345678abcdefgh");
  EXPECT_EQ(digests.size(), texts);
}

// Each half is a hash: no two of 10^4 texts share a half.
TEST(Digest, HasTwoIndependentHalves) {
  std::set<std::string> first, second;
  constexpr std::size_t texts = 10'000;
  for (std::size_t i = 0; i < texts; ++i) {
    const std::string both = digest("component " + std::to_string(i));
    first.insert(both.substr(0, 16));
    second.insert(both.substr(16));
  }
  EXPECT_EQ(first.size(), texts);
  EXPECT_EQ(second.size(), texts);
}

}  // namespace
}  // namespace gamer::digest_test
