#include "gamer/core/utc_time.h"

#include <gtest/gtest.h>

#include <array>
#include <ctime>
#include <random>

namespace gamer::utc_time_test {
namespace {

TEST(UtcTime, KnownMoments) {
  EXPECT_EQ(utc_time_text(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(utc_time_text(1000000000), "2001-09-09T01:46:40Z");
  EXPECT_EQ(utc_time_text(951782400), "2000-02-29T00:00:00Z");
}

// The dates of the C library are independent.
TEST(UtcTime, AgreesWithTheLibrary) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 10000; ++i) {
    constexpr std::time_t end = 253402300800;  // the year 10000
    const auto time = static_cast<std::time_t>(random() % static_cast<unsigned long long>(end));
    std::tm fields{};
    gmtime_r(&time, &fields);
    std::array<char, 32> expected{};
    std::strftime(expected.data(), expected.size(), "%Y-%m-%dT%H:%M:%SZ", &fields);
    ASSERT_EQ(utc_time_text(time), expected.data());
  }
}

}  // namespace
}  // namespace gamer::utc_time_test
