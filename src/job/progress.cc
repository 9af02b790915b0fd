#include "gamer/job/progress.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include "gamer/core/clock.h"
#include "gamer/core/utc_time.h"

namespace gamer {
namespace {

constexpr double bar_interval = 0.1;  // seconds between two drawings
constexpr double line_interval = 60;  // seconds between two lines at most
constexpr double tenth_interval = 5;  // seconds between two lines at least
// Bounds of the seconds between two JSON objects. Within them, the interval is a tenth of the time
// so far.
constexpr double shortest_object_interval = 1, object_interval = 10;
constexpr int bar_width = 30;
constexpr int seconds_per_minute = 60;
constexpr int seconds_per_hour = 3600;

/// "2026-11-25 12:30:05", local time.
std::string local_date() {
  return fmt::format("{:%Y-%m-%d %H:%M:%S}", fmt::localtime(std::time(nullptr)));
}

std::string utc_date() { return utc_time_text(std::time(nullptr)); }

/// "1:02:03" or "2:03".
std::string clock_text(double seconds) {
  const auto whole = static_cast<long long>(std::ceil(seconds));
  const long long hours = whole / seconds_per_hour;
  const long long minutes = whole % seconds_per_hour / seconds_per_minute;
  if (hours > 0) return fmt::format("{}:{:02}:{:02}", hours, minutes, whole % seconds_per_minute);
  return fmt::format("{}:{:02}", minutes, whole % seconds_per_minute);
}

}  // namespace

Progress::Style Progress::style_for(std::FILE* stream) {
  return isatty(fileno(stream)) != 0 ? Style::bar : Style::lines;
}

Progress::Progress(int total, std::string unit, Style style, std::FILE* stream,
                   std::function<double()> clock, std::function<std::string()> date)
    : total_(total),
      unit_(std::move(unit)),
      style_(style),
      stream_(stream),
      clock_(clock ? std::move(clock) : steady_seconds),
      date_(std::move(date)),
      start_(clock_()),
      shown_(start_) {
  if (!date_) date_ = style_ == Style::json ? utc_date : local_date;
  if (style_ == Style::json) show();
}

Progress::~Progress() {
  if (style_ == Style::json && shown_done_ != done_) show();
  if (drawn_) std::fputs("\n", stream_);
}

double Progress::interval() const {
  if (style_ == Style::bar) return bar_interval;
  if (style_ != Style::json) return line_interval;
  return std::clamp(seconds() / 10, shortest_object_interval, object_interval);
}

void Progress::add(int count) {
  done_ += count;
  if (style_ == Style::none) return;
  const double since = clock_() - shown_;
  // Jobs of less than a minute print no lines.
  const bool is_tenth = style_ == Style::lines && seconds() >= line_interval &&
                        since >= tenth_interval && tenth() > shown_tenth_;
  const bool is_end = style_ == Style::bar && done_ == total_;
  if (since >= interval() || is_tenth || is_end) show();
}

void Progress::skip(int count) {
  done_ += count;
  skipped_ += count;
}

ProgressNumbers Progress::numbers() const {
  const double elapsed = seconds();
  const double rate = elapsed > 0 ? (done_ - skipped_) / elapsed : 0;
  return {done_, total_, unit_, rate, rate > 0 ? (total_ - done_) / rate : -1};
}

std::string Progress::text() const {
  const ProgressNumbers now = numbers();
  std::string result = fmt::format(" %  {:.1f} {}/s", now.rate, unit_);
  if (now.left >= 0) result += fmt::format("  {} left", clock_text(now.left));
  return result;
}

void Progress::show() {
  shown_ = clock_();
  shown_tenth_ = tenth();
  shown_done_ = done_;
  const std::string line = fmt::format("{:>3}", share_of(100)) + text();
  std::string shown;
  if (style_ == Style::json) {
    shown = json_message(date_(), fmt::format("{}{}", share_of(100), text()), numbers());
  } else if (style_ == Style::lines) {
    shown = fmt::format("gamer: {} {}\n", date_(), line);
  } else {
    const auto filled = static_cast<std::size_t>(share_of(bar_width));
    const std::string bar = std::string(filled, '#') + std::string(bar_width - filled, '.');
    // \r and "erase to the end of the line".
    shown = fmt::format("\r[{}] {}\x1b[K", bar, line);
    drawn_ = true;
  }
  // Errors are ignored: a job goes on when nobody reads its messages.
  std::fputs(shown.c_str(), stream_);
  std::fflush(stream_);
}

std::function<void(int, int)> GalaxyProgress::counter() {
  return [this](int more, int total) {
    if (!progress_) progress_.emplace(total, "galaxies", style_, stderr);
    progress_->add(more);
  };
}

}  // namespace gamer
