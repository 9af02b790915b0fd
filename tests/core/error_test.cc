#include "gamer/core/error.h"

#include <gtest/gtest.h>

namespace gamer::error_test {
namespace {

TEST(SourceLocation, LeavesOutWhatIsUnknown) {
  EXPECT_EQ((SourceLocation{"a.par", 3, 7}.text()), "a.par:3:7");
  EXPECT_EQ((SourceLocation{"a.par", 3, 0}.text()), "a.par:3");
  EXPECT_EQ((SourceLocation{"a.par", 0, 7}.text()), "a.par");
}

TEST(InputError, OpensWithTheLocation) {
  EXPECT_STREQ(InputError({"a.par", 3, 7}, "wrong").what(), "a.par:3:7: wrong");
  EXPECT_STREQ(InputError({"", 3, 7}, "wrong").what(), "wrong");
}

}  // namespace
}  // namespace gamer::error_test
