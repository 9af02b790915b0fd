#include "gamer/job/progress.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <ctime>
#include <utility>

namespace gamer {
namespace {

constexpr double bar_interval = 0.1;  // seconds between two drawings
constexpr double line_interval = 60;  // seconds between two lines at most
constexpr double tenth_interval = 5;  // seconds between two lines at least
constexpr int bar_width = 30;
constexpr int seconds_per_minute = 60;
constexpr int seconds_per_hour = 3600;

double steady_seconds() {
  using std::chrono::duration;
  using std::chrono::steady_clock;
  return duration<double>(steady_clock::now().time_since_epoch()).count();
}

/// "2026-11-25 12:30:05", local time.
std::string local_date() {
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::localtime(std::time(nullptr)));
}

/// "1:02:03" or "2:03".
std::string clock_text(double seconds) {
  const auto whole = static_cast<long long>(std::ceil(seconds));
  const long long hours = whole / seconds_per_hour;
  const long long minutes = whole % seconds_per_hour / seconds_per_minute;
  if (hours > 0) {
    return fmt::format("{}:{:02}:{:02}", hours, minutes, whole % seconds_per_minute);
  }
  return fmt::format("{}:{:02}", minutes, whole % seconds_per_minute);
}

}  // namespace

Progress::Style Progress::style_for(std::FILE* stream) {
  return isatty(fileno(stream)) != 0 ? Style::bar : Style::lines;
}

Progress::Progress(int rows, Style style, std::FILE* stream, std::function<double()> clock,
                   std::function<std::string()> date)
    : rows_(rows),
      style_(style),
      stream_(stream),
      clock_(clock ? std::move(clock) : steady_seconds),
      date_(date ? std::move(date) : local_date),
      start_(clock_()),
      shown_(start_) {}

Progress::~Progress() {
  if (drawn_) std::fputs("\n", stream_);
}

void Progress::add(int rows) {
  done_ += rows;
  if (style_ == Style::none) return;
  const bool is_bar = style_ == Style::bar;
  const double since = clock_() - shown_;
  // Jobs of less than a minute say nothing.
  const bool is_tenth =
      !is_bar && seconds() >= line_interval && since >= tenth_interval && tenth() > shown_tenth_;
  const bool is_due = since >= (is_bar ? bar_interval : line_interval);
  if (is_due || is_tenth || (is_bar && done_ == rows_)) show();
}

void Progress::skip(int rows) {
  done_ += rows;
  skipped_ += rows;
}

std::string Progress::text() const {
  const double elapsed = seconds();
  const double rate = elapsed > 0 ? (done_ - skipped_) / elapsed : 0;
  const int percent = static_cast<int>(100.0 * done_ / rows_);
  std::string result = fmt::format("{:3} %  {:.1f} {}/s", percent, rate, unit_);
  if (rate > 0) result += fmt::format("  {} left", clock_text((rows_ - done_) / rate));
  return result;
}

void Progress::show() {
  shown_ = clock_();
  shown_tenth_ = tenth();
  if (style_ == Style::lines) {
    fmt::print(stream_, "gamer: {} {}\n", date_(), text());
  } else {
    const auto filled = static_cast<std::size_t>(static_cast<double>(bar_width) * done_ / rows_);
    const std::string bar = std::string(filled, '#') + std::string(bar_width - filled, '.');
    // \r and "erase to the end of the line".
    fmt::print(stream_, "\r[{}] {}\x1b[K", bar, text());
    drawn_ = true;
  }
  std::fflush(stream_);
}

}  // namespace gamer
