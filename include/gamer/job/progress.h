#pragma once

#include <cstdio>
#include <functional>
#include <string>
#include <utility>

namespace gamer {

/// Tells how far a run has come. Not for several threads at a time.
class Progress {
 public:
  enum class Style {
    none,
    bar,    ///< a line that is drawn again, for a terminal
    lines,  ///< from a minute on, a dated line each minute and each tenth
  };
  /// The style that suits `stream`.
  static Style style_for(std::FILE* stream);

  /// `clock` gives seconds; by default a steady clock. `date` begins lines; by default local time.
  Progress(int rows, Style style, std::FILE* stream, std::function<double()> clock = {},
           std::function<std::string()> date = {});
  /// Counts something else than rows: "frames".
  void count(std::string unit) { unit_ = std::move(unit); }
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Counts rows that are done now.
  void add(int rows);
  /// Counts rows that were done before; they do not count for the rate.
  void skip(int rows);
  int skipped() const { return skipped_; }
  double seconds() const { return clock_() - start_; }

 private:
  std::string text() const;
  /// Tenths of the rows that are done.
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
