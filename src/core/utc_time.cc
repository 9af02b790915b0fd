#include "gamer/core/utc_time.h"

#include <chrono>
#include <cstddef>

namespace gamer {
namespace {

/// Writes a number of `width` digits, from `at` on.
void put_digits(UtcTime& text, std::size_t at, std::size_t width, unsigned number) noexcept {
  constexpr unsigned base = 10;
  for (std::size_t place = at + width; place > at; number /= base) {
    text[--place] = static_cast<char>('0' + number % base);
  }
}

}  // namespace

UtcTime utc_time(std::time_t time) noexcept {
  using std::chrono::days, std::chrono::seconds;
  const std::chrono::sys_seconds moment{seconds(time)};
  const auto midnight = std::chrono::floor<days>(moment);
  const std::chrono::year_month_day date(midnight);
  const std::chrono::hh_mm_ss clock(moment - midnight);
  UtcTime text = {'0', '0', '0', '0', '-', '0', '0', '-', '0', '0',
                  'T', '0', '0', ':', '0', '0', ':', '0', '0', 'Z'};
  put_digits(text, 0, 4, static_cast<unsigned>(static_cast<int>(date.year())));
  put_digits(text, 5, 2, static_cast<unsigned>(date.month()));
  put_digits(text, 8, 2, static_cast<unsigned>(date.day()));
  put_digits(text, 11, 2, static_cast<unsigned>(clock.hours().count()));
  put_digits(text, 14, 2, static_cast<unsigned>(clock.minutes().count()));
  put_digits(text, 17, 2, static_cast<unsigned>(clock.seconds().count()));
  return text;
}

std::string utc_time_text(std::time_t time) {
  const UtcTime text = utc_time(time);
  return {text.begin(), text.end()};
}

}  // namespace gamer
