#pragma once

#include <cstdio>
#include <functional>
#include <optional>
#include <string>

#include "gamer/job/message_log.h"

namespace gamer {

/// The progress of a run, shown to the user. One thread at a time may use it.
class Progress {
 public:
  enum class Style {
    none,
    bar,    ///< one line that is redrawn, for a terminal
    lines,  ///< after the first minute, a dated line for each minute and each tenth
    json    ///< json_message() at once, each tenth of the time so far, and at the end
  };
  /// The style that suits `stream`.
  static Style style_for(std::FILE* stream);

  /// `unit` names the counted things, such as "rows". `clock` gives seconds; by default it is a
  /// steady clock. `date` gives the time that begins a line; by default this is local time, in JSON
  /// objects UTC.
  Progress(int total, std::string unit, Style style, std::FILE* stream,
           std::function<double()> clock = {}, std::function<std::string()> date = {});
  ~Progress();
  Progress& operator=(Progress&&) = delete;

  /// Counts things that this run has done.
  void add(int count);
  /// Counts things that an earlier run has done, which the rate leaves out.
  void skip(int count);
  int skipped() const { return skipped_; }
  double seconds() const { return clock_() - start_; }

 private:
  ProgressNumbers numbers() const;
  /// The text behind the percents: rate and time left.
  std::string text() const;
  /// Number of finished tenths.
  int tenth() const { return static_cast<int>(share_of(10)); }
  /// The finished share, in parts of 1/all, rounded down.
  long long share_of(int all) const { return total_ > 0 ? 1LL * all * done_ / total_ : all; }
  /// Seconds between two messages.
  double interval() const;
  void show();

  int total_;
  std::string unit_;
  int done_ = 0;
  int skipped_ = 0;
  Style style_;
  std::FILE* stream_;
  std::function<double()> clock_;
  std::function<std::string()> date_;
  double start_;
  double shown_;
  int shown_tenth_ = 0;
  int shown_done_ = -1;
  bool drawn_ = false;
};

/// The progress of RenderJob::Pending::progress.
class GalaxyProgress {
 public:
  explicit GalaxyProgress(Progress::Style style) : style_(style) {}
  /// Must not outlive this object.
  std::function<void(int more, int total)> counter();

 private:
  Progress::Style style_;
  std::optional<Progress> progress_;  ///< once a galaxy is counted
};

}  // namespace gamer
