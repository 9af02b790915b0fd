#pragma once

#include <cstdio>
#include <functional>
#include <string>
#include <utility>

namespace gamer {

/// The progress of a run, shown to the user. One thread at a time may use it.
class Progress {
 public:
  enum class Style {
    none,
    bar,    ///< one line that is redrawn, for a terminal
    lines,  ///< after a minute, a dated line each minute and each tenth
  };
  /// The style that suits `stream`.
  static Style style_for(std::FILE* stream);

  /// `clock` gives seconds; by default a steady clock. `date` begins lines; by default local time.
  Progress(int rows, Style style, std::FILE* stream, std::function<double()> clock = {},
           std::function<std::string()> date = {});
  /// Names the counted things, such as "frames"; by default rows.
  void count(std::string unit) { unit_ = std::move(unit); }
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Counts rows that were done in this run.
  void add(int rows);
  /// Counts rows that were done before, which do not count for the rate.
  void skip(int rows);
  int skipped() const { return skipped_; }
  double seconds() const { return clock_() - start_; }

 private:
  std::string text() const;
  /// Finished rows in tenths of all rows.
  int tenth() const { return static_cast<int>(10LL * done_ / rows_); }
  void show();

  std::string unit_ = "rows";
  int rows_;
  int done_ = 0;
  int skipped_ = 0;
  Style style_;
  std::FILE* stream_;
  std::function<double()> clock_;
  std::function<std::string()> date_;
  double start_;
  double shown_;
  int shown_tenth_ = 0;
  bool drawn_ = false;
};

}  // namespace gamer
